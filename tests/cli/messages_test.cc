#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <exiv2/exiv2.hpp>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"

// What the commands print beside their results: remarks, tables, and what to do next.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

const fs::path kSample = fs::path(HEXCAL_SOURCE) / "samples" / "small_lab";

class Messages : public ::testing::Test {
 protected:
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  [[nodiscard]] std::string lab(const std::string& name = "") const { return file("lab/" + name); }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(file(name), std::ios::binary) << text;
  }
  void replace(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = contents(file(name));
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    put(name, text.replace(at, from.size(), to));
  }
  static std::string said(const std::vector<std::string>& arguments, int exit_code) {
    const CommandResult result = run_hexcal(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.out << result.err;
    return result.out + result.err;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(Messages, OfACheckedCampaign) {
  copy_sample_campaign(lab(), {"home", "p001", "p002", "p003"});
  EXPECT_THAT(
      said({"check", lab()}, 0),
      AllOf(HasSubstr("ok   " + lab("campaign.yaml: 10 fixed and 10 moving markers of tag36h11")),
            HasSubstr("camera.yaml: 1504 x 1000 px, f 2252.8 px, radial; no covariance: sigmas of "
                      "poses will be too small"),
            HasSubstr("ok   " + lab("hexapod.yaml: a platform of six legs")),
            HasSubstr("warn target p008: has no photographs"), HasSubstr("ok   pose p003: 3 photo"),
            EndsWith("12 photographs in 4 poses; no problem, 6 warnings\nnext: hexcal run " + lab() + "\n")));

  const std::string poses = "lab/poses/";
  fs::remove(file(poses + "p001/DSC_0005.jpg"));
  fs::remove(file(poses + "p001/DSC_0006.jpg"));
  for (const char* name : {"7", "8", "9"}) fs::remove(file(fmt::format("{}p002/DSC_000{}.jpg", poses, name)));
  put(poses + "p003/DSC_0010.jpg", "");
  put(poses + "p003/DSC_0011.jpg", std::string(300, '\0'));
  fs::copy_file(file(poses + "home/DSC_0001.jpg"), file(poses + "p003/DSC_0013.jpg"));
  cv::imwrite(file(poses + "p003/DSC_0014.png"), cv::Mat::zeros(20, 30, CV_8UC1));
  fs::copy_file(file(poses + "home/DSC_0001.jpg"), file(poses + "stray.jpg"));
  put("lab/hexapod.yaml", "base_joints_mm: none\n");
  const std::vector<std::string> heads{"p003/DSC_0010.jpg: is empty",
                                       "p003/DSC_0011.jpg: is no photograph that can be read",
                                       "p003/DSC_0013.jpg: is the same photograph as home/DSC_0001.jpg",
                                       "p003/DSC_0014.png: 30 x 20 px, the camera file is for 1504 x 1000"};
  const std::string stray = "stray.jpg: stray: it lies beside the pose folders, in none of them";
  std::string words = said({"check", lab()}, 1);
  for (const std::string& head : heads) EXPECT_THAT(words, HasSubstr("BAD  " + head + "\n"));
  EXPECT_THAT(words, AllOf(HasSubstr("warn pose p001: 1 photographs, wanted at least 2"),
                           HasSubstr("BAD  pose p002: 0 photographs"), HasSubstr("warn " + stray),
                           HasSubstr("BAD  " + lab("hexapod.yaml:1: base_joints_mm: found 'none'")),
                           EndsWith("; 6 problems\n")));
  words = said({"measure", lab(), "--dry-run"}, 1);
  for (const std::string& head : heads) EXPECT_THAT(words, HasSubstr("  " + head + "\n"));
  EXPECT_THAT(words,
              AllOf(HasSubstr("p001: DSC_0004.jpg (one photograph only)\n"),
                    HasSubstr("p002: no photograph that counts\n"), HasSubstr("not used: " + stray + "\n")));
  EXPECT_FALSE(fs::exists(lab("results")));

  replace("lab/campaign.yaml", "camera: camera.yaml", "camera: [{file: camera.yaml, serial: 77}]");
  replace("lab/campaign.yaml", "pose: home", "pose: p009");
  EXPECT_THAT(said({"check", lab()}, 1),
              AllOf(HasSubstr("found 'p009', which is none of the poses: home, p001, p002, p003"),
                    HasSubstr("p001/DSC_0004.jpg: no camera file is for it (serial 2419077)")));
  replace("lab/campaign.yaml", "[0-9]", "[0-9, 587]");
  EXPECT_THAT(said({"check", lab()}, 2), HasSubstr("campaign.yaml: marker 587: tag36h11 has ids 0 to 586"));
  fs::remove_all(lab("poses"));
  fs::create_directory(lab("poses"));
  replace("lab/campaign.yaml", "[0-9, 587]", "[0-9]");
  EXPECT_THAT(said({"check", lab()}, 2), HasSubstr("poses: holds no photographs"));
}

TEST_F(Messages, OfPhotographsGroupedByTime) {
  copy_sample_campaign(lab());
  fs::copy_file(kSample / "poses/home/DSC_0001.jpg", lab("poses/DSC_0001.jpg"));
  cv::imwrite(lab("poses/DSC_0002.png"), cv::Mat::zeros(20, 30, CV_8UC1));
  for (const auto& [name, time] :
       {std::pair("DSC_0003.jpg", "yesterday, noon..."), std::pair("DSC_0004.jpg", "2026:02:30 10:00:00")}) {
    fs::copy_file(lab("poses/DSC_0001.jpg"), lab(std::string("poses/") + name));
    const auto image = Exiv2::ImageFactory::open(lab(std::string("poses/") + name));
    image->readMetadata();
    image->exifData()["Exif.Photo.DateTimeOriginal"] = time;
    image->writeMetadata();
  }
  EXPECT_THAT(
      said({"measure", lab(), "--dry-run", "--group-by-time", "60"}, 0),
      AllOf(HasSubstr("g01: DSC_0001.jpg (one photograph only)\n"),
            HasSubstr("not used: DSC_0002.png: has no capture time in its EXIF, which --group-by-time"),
            HasSubstr("DSC_0003.jpg: capture time 'yesterday, noon...', wanted YYYY:MM:DD hh:mm:ss"),
            HasSubstr("DSC_0004.jpg: capture time '2026:02:30 10:00:00', wanted")));
}

// One measurement and what is made of it.
TEST_F(Messages, OfAMeasurementAndItsReport) {
  copy_sample_campaign(lab(), {"home", "p001"});
  fs::copy_file(lab("poses/home/DSC_0001.jpg"), lab("poses/stray.jpg"));
  replace(
      "lab/campaign.yaml", "scale: {from: markers, print_scale_sigma: 0}",
      "scale: {bars: [{a: 0.0, b: 0.1, length_mm: 24.0032, sigma_mm: 0.002}]}\n"
      "checks: [{a: 0, b: 1, length_mm: 32.05, sigma_mm: 0.1}, {a: 0, b: 11, length_mm: 30, sigma_mm: 0.1}]");
  replace("lab/campaign.yaml", "[0-9]", "[0-9, 11]");
  replace("lab/targets.csv", "p001,-10.752512", "p001,here");
  EXPECT_THAT(said({"measure", lab()}, 0),
              AllOf(HasSubstr("not used: stray.jpg: stray: "), HasSubstr("bar 0.0-0.1: measured 24.00"),
                    HasSubstr("stated 24.0032, difference"), HasSubstr("check 0-1: measured 32.0"),
                    HasSubstr("check 0-11: not measured\n"),
                    HasSubstr("warning: not compared with the targets: " + lab("targets.csv:4: "))));

  const auto page = [&](int exit_code = 0) {
    const std::string words = said({"report", lab()}, exit_code);
    return exit_code == 0 ? contents(lab("results/report.html")) : words;
  };
  EXPECT_THAT(page(2), HasSubstr("targets.csv:4: column 'x_mm': 'here' is not a number"));
  replace("lab/targets.csv", "p001,here", "p001,-10.752512");
  EXPECT_THAT(page(), HasSubstr("No compensation: 1 measured poses besides home, wanted at least 4"));
  EXPECT_THAT(said({"report", lab(), "--figures", file("figures")}, 0),
              HasSubstr(" figures, SVG and PDF, to " + file("figures") + "\n"));
  EXPECT_TRUE(fs::exists(file("figures/scene.pdf")));
  const std::string quality = contents(lab("results/quality.json"));
  put("lab/results/quality.json", "{");
  EXPECT_THAT(page(2), HasSubstr("quality.json: [json.exception.parse_error"));
  put("lab/results/quality.json", "{}");
  EXPECT_THAT(page(2), HasSubstr("quality.json: [json.exception.out_of_range.403] key 'verdict' not found"));
  fs::remove(lab("results/quality.json"));
  EXPECT_THAT(page(), HasSubstr("run <code>hexcal measure</code> again to see photographs"));
  put("lab/results/quality.json", quality);
  replace("lab/campaign.yaml", "targets: targets.csv\nlegs: legs.csv\n", "");
  EXPECT_THAT(
      page(),
      HasSubstr("Name <code>targets</code> or <code>legs</code> in campaign.yaml and run <code>hexcal"));
  EXPECT_THAT(said({"run", lab()}, 0), HasSubstr("not compensated: campaign.yaml names no targets\n"));
  replace("lab/campaign.yaml", "hexapod: hexapod.yaml\n", "");
  EXPECT_THAT(said({"run", lab()}, 0), HasSubstr("not compensated: campaign.yaml names no hexapod\n"));
  EXPECT_THAT(contents(lab("results/report.html")),
              HasSubstr("Name the <code>hexapod</code> in campaign.yaml"));

  fs::remove(lab("results/.lock"));
  fs::create_symlink("elsewhere", lab("results/.lock"));
  EXPECT_THAT(said({"measure", lab()}, 2), HasSubstr(".lock: cannot be written: "));
}

TEST_F(Messages, OfAWatchedFolder) {
  copy_sample_campaign(lab(), {"home", "p001"});
  fs::remove(lab("poses/p001/DSC_0004.jpg"));
  fs::rename(lab("poses/home"), lab("home"));
  EXPECT_THAT(said({"watch", lab(), "--expect", "2", "--stop-after", "0.1"}, 0),
              AllOf(HasSubstr("poses wait for the home pose 'home'\n"), Not(HasSubstr("p001: "))));
  fs::remove_all(lab("results"));
  fs::rename(lab("home"), lab("poses/home"));
  EXPECT_THAT(said({"watch", lab(), "--stop-after", "0.1"}, 0),
              AllOf(HasSubstr("GREEN  home: 0.0000 0.0000 0.0000 mm  0.0000 0.0000 0.0000 deg  sigma 0.00 um "
                              "0.00 mdeg  3 photos\n"),
                    EndsWith("p001 has 2 of 3 photographs\n")));
}

TEST_F(Messages, OfDetectedMarkers) {
  const std::string one = (kSample / "poses/p001/DSC_0004.jpg").string();
  put("no.jpg", "x");
  EXPECT_THAT(said({"detect", file("no.jpg"), one, "-o", file("o.txt"), "--ids", "3,100"}, 1),
              AllOf(HasSubstr("no.jpg            0  unreadable: neither JPEG, PNG, TIFF, BMP nor HEIC\n"),
                    EndsWith("2 photographs, 2 markers in " + file("o.txt") +
                             "\nnext: hexcal measure CAMPAIGN --observations " + file("o.txt") + "\n")));
}

// On a terminal a bar says how long it may still take.
TEST_F(Messages, OfABarOnATerminal) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (terminal < 0) GTEST_SKIP() << "no pseudo-terminals here";
  ASSERT_EQ(::grantpt(terminal) + ::unlockpt(terminal), 0);
  const char* const name = ::ptsname(terminal);
  ASSERT_NE(name, nullptr);
  const int other_end = ::open(name, O_RDWR | O_NOCTTY);  // what was written stays while one end is open
  const std::string line = fmt::format("'{}' detect '{}' -o '{}' --ids 3 >/dev/null 2>{}", HEXCAL_BINARY,
                                       (kSample / "poses/p001").string(), file("o.txt"), name);
  EXPECT_EQ(std::system(line.c_str()), 0);
  std::string bar(65536, '\0');
  const ssize_t size = ::read(terminal, bar.data(), bar.size());
  ::close(other_end);
  ::close(terminal);
  ASSERT_GT(size, 0);
  bar.resize(static_cast<std::size_t>(size));
  EXPECT_THAT(bar, AllOf(HasSubstr("detect [##########"), HasSubstr("] 1/3  "), HasSubstr(" s left"),
                         HasSubstr("] 3/3")));
}

TEST_F(Messages, OfMachinesAtTheirLimits) {
  const std::string h = (kSample / "hexapod.yaml").string();
  const std::string readings = "460,460,460,460,460,460";
  put("far.csv",
      "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\na,0,0,0,0,0,0\nfar,0,0,-300,0,0,0\nup,0,0,300,0,0,"
      "0\n");
  EXPECT_THAT(
      said({"workspace", "--hexapod", h, "--poses", file("far.csv"), "-o", file("w.csv")}, 1),
      HasSubstr("2 of 3 poses are not reachable (status in " + file("w.csv") + "), the first is far\n"));
  EXPECT_THAT(contents(file("w.csv")), AllOf(HasSubstr("\na,ok,"), HasSubstr("\nfar,too_short,")));
  EXPECT_THAT(
      said({"legs", "--hexapod", h, "--poses", file("far.csv"), "-o", file("l.csv")}, 1),
      HasSubstr("2 of 3 poses are out of reach (status in " + file("l.csv") + "), the first is far\n"));
  put("legs.csv", "pose,q1,q2,q3,q4,q5,q6\na,460,460,460,460,460,460\nb,460,460,460,460,460,5000\n");
  EXPECT_THAT(said({"pose", "--hexapod", h, "--legs", file("legs.csv"), "-o", file("p.csv")}, 1),
              HasSubstr("1 of 2 rows failed (status in " + file("p.csv") + "), the first is b\n"));
  // Up to where the grips, 50 mm apart at home, meet.
  EXPECT_THAT(
      said({"workspace", "--hexapod", h, "--box"}, 0),
      AllOf(HasSubstr("x_mm -1"), HasSubstr("\nz_mm -50.098 .. 50.000\n"), HasSubstr("\nvolume_mm3 5")));
  EXPECT_THAT(said({"workspace", "--hexapod", h, "--box", "--at", "0,0,0,80,0,0"}, 1),
              HasSubstr("home's position is not valid at this orientation with these margins"));
  EXPECT_THAT(said({"workspace", "--hexapod", h, "--sample", "uniform", "-n", "3", "--margin-mm", "150", "-o",
                    file("s.csv")},
                   1),
              HasSubstr("found 0 valid poses of 3 after "));
  // The platform below the base has the same legs as above it.
  EXPECT_THAT(
      said({"pose", "--hexapod", h, "--readings", readings, "--certify", "--box", "0.1,0.1,900,0.1,0.1,0.1"},
           1),
      AllOf(HasSubstr(",several,2\n"), HasSubstr("hexcal: 2 poses in the box\n")));
}

TEST_F(Messages, OfAModelAndOfSimulations) {
  const auto simulate = [&](std::vector<std::string> more, int exit_code) {
    more.insert(more.begin(), {"simulate", "--no-images"});
    return said(more, exit_code);
  };
  EXPECT_THAT(simulate({"-o", file("sim"), "--poses", "12", "--seed", "3"}, 0),
              EndsWith("0 photographs, truth in " + file("sim/truth") + "\n"));
  EXPECT_THAT(simulate({"-o", file("sim"), "--from", file("sim"), "--commands", file("sim/legs.csv")}, 2),
              HasSubstr("sim: the second round needs a folder of its own"));
  std::string fewer;
  std::ifstream in(file("sim/legs.csv"));
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with("p003")) fewer += line + '\n';
  put("fewer.csv", fewer);
  EXPECT_THAT(
      simulate({"-o", file("two"), "--from", file("sim"), "--commands", file("fewer.csv")}, 1),
      AllOf(HasSubstr("  no photographs of p003: not commanded\n"),
            EndsWith("next: cp " + file("sim") + "/camera.yaml " + file("two") + " && hexcal measure " +
                     file("two") + " && hexcal report " + file("two") + " --before " + file("sim") + "\n")));
  const auto rendered = [&](const std::string& name, const std::string& sheets, bool true_camera) {
    std::vector<std::string> arguments{"simulate",          "-o", file(name), "--poses", "0",
                                       "--photos-per-pose", "1"};
    arguments.insert(arguments.end(), {"--calibration-photos", sheets, "--width", "120"});
    if (true_camera) arguments.emplace_back("--true-camera");
    return said(arguments, 0);
  };
  EXPECT_THAT(rendered("a", "1", false),
              EndsWith(fmt::format("next: hexcal camera {0}/calibration --template {0}/sheet.yaml -o "
                                   "{0}/camera.yaml\n",
                                   file("a"))));
  EXPECT_THAT(rendered("b", "0", true), EndsWith("next: hexcal run " + file("b") + "\n"));

  const std::string model = file("out/model.yaml");
  (void)said({"compensate", "--hexapod", file("sim/hexapod.yaml"), "--targets", file("sim/targets.csv"),
              "--poses", file("sim/truth/poses.csv"), "--method", "geometry", "-o", file("out")},
             0);
  EXPECT_THAT(said({"pose", "--model", model, "--readings", "1,1,1,1,1,9999"}, 1),
              AllOf(HasSubstr("1,no_pose,,,,,,\n"), HasSubstr("the model has no pose for these readings")));
  EXPECT_THAT(said({"pose", "--model", model, "--readings", "1,1,1,1,1,1", "--all"}, 2),
              HasSubstr("--certify, --all: work on a geometry; give --hexapod instead of --model"));
}

TEST_F(Messages, OfPosesWithoutATargetAndTargetsWithoutAPose) {
  const std::string head = "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";
  put("t.csv", head + "a,0,0,0,0,0,0\nb,10,0,0,5,0,0\nc,0,5,0,0,1,0\n");
  put("b.csv",
      "pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\na,ok,1,0,0,0,0,0\nb,ok,11,0,0,5,0,0\n"
      "c,no_photographs,,,,,,\nd,no_photographs,,,,,,\nz,ok,1,1,1,1,1,1\n");
  EXPECT_THAT(said({"evaluate", "--targets", file("t.csv"), "--before", file("b.csv")}, 1),
              AllOf(HasSubstr("same 2 poses"), HasSubstr("before: no pose for c, d\n"),
                    EndsWith("before: no target for z\n")));
}

TEST_F(Messages, OfACameraCalibratedComparedAndExported) {
  std::vector<std::string> arguments{"camera", "--template",   (kSample / "sheet.yaml").string(),
                                     "-o",     file("c.yaml"), "--model",
                                     "brown",  "--board",      "ideal"};
  for (int n = 28; n < 33; ++n)
    arguments.push_back((kSample / fmt::format("calibration/DSC_00{}.jpg", n)).string());
  EXPECT_THAT(
      run_hexcal(arguments).out,
      AllOf(HasSubstr("photograph    points  rejected  rms_px  tilt_deg  distance_mm  blur_px  status\n"),
            HasSubstr("\nmodel "), HasSubstr("\nf_px      22"), HasSubstr("\nrms_px 0.0"),
            HasSubstr("   points "), HasSubstr("   photographs 5\n"),
            HasSubstr("projection uncertainty: centre 0."), HasSubstr(" px rms; coverage "),
            HasSubstr("correlations over 0.95: "), HasSubstr("\nverdict: "), HasSubstr("  - "),
            HasSubstr("\nwrote " + file("c.yaml") + ", " + file("c.inputs.csv") + "\n")));
  const std::string compared =
      said({"camera", "--compare", file("c.yaml"), (kSample / "camera.yaml").string()}, 0);
  EXPECT_THAT(compared,
              AllOf(HasSubstr("difference of projection over the frame, best rotation taken out, px"),
                    HasSubstr("\nrms 0."), HasSubstr(" px, largest "), Not(HasSubstr("expected"))))
      << "one of the two knows no uncertainty";
  EXPECT_THAT(said({"camera", "--compare", file("c.yaml"), file("c.yaml")}, 0),
              AllOf(HasSubstr("rms 0.0000 px, largest 0.0000 px; expected from both uncertainties 0."),
                    EndsWith(" px rms: no significant difference\n")));
  EXPECT_EQ(said({"export", file("c.yaml"), "--to", "opencv", "-o", file("o.yml")}, 0),
            "wrote " + file("o.yml") + ": OpenCV 5 coefficients, the same camera\n");
  EXPECT_EQ(said({"export", file("o.yml"), "--to", "hexcal", "-o", file("back.yaml")}, 0),
            "wrote " + file("back.yaml") + ": opencv values as brown, the same camera\n");
  EXPECT_THAT(said({"export", (kSample / "camera.yaml").string(), "--to", "kalibr", "-o", file("k.yaml")}, 0),
              AllOf(HasSubstr("k.yaml: pinhole-radtan, 0."),
                    HasSubstr(" px rms from the camera over the frame (max")));
}

// What the machine refuses, and no fault of hexcal.
TEST_F(Messages, OfNamesAndDisksThatTheSystemRefuses) {
  const std::string name(300, 'a');
  for (const char* command : {"measure", "check", "report"})
    EXPECT_EQ(said({command, name}, 2), fmt::format("hexcal: {}: File name too long\n", name)) << command;
  if (!fs::exists("/dev/full")) return;
  for (const char* arguments : {"completion bash", "completion man"}) {
    const std::string line = fmt::format("'{}' {} >/dev/full 2>'{}'", HEXCAL_BINARY, arguments, file("err"));
    EXPECT_NE(std::system(line.c_str()), 0) << arguments;
    EXPECT_THAT(contents(file("err")), AllOf(HasSubstr("No space left on device"), Not(HasSubstr("bug"))));
  }
}

}  // namespace
}  // namespace hexcal
