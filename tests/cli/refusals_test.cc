#include <gmock/gmock.h>

#include <fstream>
#include <set>

#include "tests/support/hexapods.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/hexapod_file.h"

// What the commands say of flags that do not go together: exit code 2, one line with the flag and what was
// wanted, and no file written.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class CommandRefusals : public ::testing::Test {
 protected:
  void SetUp() override {
    copy_sample_campaign(file("lab"), {"home", "p001"});
    fs::create_directory(file("empty"));
    std::ofstream(file("h.yaml")) << hexapod_text("", surrogate_hexapod());
    std::ofstream(file("poses.csv")) << "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";
    std::ofstream(file("words.txt")) << "no table\n";
    std::ofstream(file("sheets.yaml"))
        << "sheets:\n  - {kind: chessboard, columns: 6, rows: 5, square_mm: 20}\n"
           "  - {kind: chessboard, columns: 6, rows: 5, square_mm: 20}\n";
    before_ = everything();
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  [[nodiscard]] std::set<fs::path> everything() const {
    std::set<fs::path> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      if (entry.path().filename() != ".lock") all.insert(entry.path());
    return all;
  }
  void expect(const std::vector<std::string>& arguments, const std::string& words) const {
    const CommandResult result = run_hexcal(arguments);
    EXPECT_EQ(result.exit_code, 2) << words;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(everything(), before_) << words;
  }

 private:
  TemporaryFolder folder_;
  std::set<fs::path> before_;
};

TEST_F(CommandRefusals, OfMachinesAndTheirPoses) {
  const std::string h = file("h.yaml");
  const std::string readings = "460,460,460,460,460,460";
  expect({"pose", "--hexapod", h}, "--legs, --readings: found none or both, wanted exactly one of them");
  expect({"pose", "--readings", readings},
         "--hexapod, --model: found none or both, wanted exactly one of them");
  expect({"pose", "--hexapod", h, "--readings", "1,2,x,4,5,6"},
         "--readings: found '1,2,x,4,5,6', wanted six numbers with commas between them");
  expect({"pose", "--hexapod", h, "--readings", readings, "--certify", "--all"},
         "--certify, --all: found both, wanted one of them");
  expect({"pose", "--hexapod", h, "--readings", readings, "--certify", "--box", "1,1,1,1,1,0"},
         "--box: found a number that is not positive, wanted six half widths");
  expect({"legs", "--hexapod", h}, "--poses, --pose: found none or both, wanted exactly one of them");
  expect({"workspace", "--hexapod", h, "--box", "--slice", "x,z"},
         "--poses, --slice, --box, --sample: found 2 of them, wanted exactly one");
  expect({"workspace", "--hexapod", h, "--box", "--svg", file("s.svg")}, "--svg: goes with --slice");
  expect({"workspace", "--hexapod", h, "--slice", "x,x", "-o", file("s.csv")},
         "--slice: found one axis twice, wanted two");
  expect({"workspace", "--hexapod", h, "--slice", "x,q", "-o", file("s.csv")},
         "--slice: found 'x,q', wanted two of x, y, z, roll, pitch, yaw, as in x,z");
  expect({"plan", "-o", file("plan.csv")},
         "--hexapod: missing, wanted hexapod.yaml or a campaign that names it");
  expect({"plan", "--hexapod", h, "--candidates", file("poses.csv"), "-n", "12", "-o", file("plan.csv")},
         "0 candidate poses, wanted at least the 12 to choose");
  expect({"compensate"}, "--hexapod: missing, wanted hexapod.yaml or a campaign that names it");
  expect({"compensate", "--hexapod", h},
         "--poses: missing, wanted the measured poses (poses.csv) or a campaign");
}

TEST_F(CommandRefusals, OfPhotographsAndCameras) {
  const std::string lab = file("lab");
  expect({"detect", file("empty"), "-o", file("o.txt")}, "empty: no photographs in this folder");
  expect({"detect", file("none.jpg"), "-o", file("o.txt")}, "none.jpg: no such file");
  expect({"detect", lab + "/poses", "--relative-to", file("empty"), "-o", file("o.txt")},
         "--relative-to: found " + file("empty") + ", wanted a folder above");
  expect({"measure", lab, "--group-by-time", "0"}, "--group-by-time: found 0, wanted more than 0");
  expect({"camera", file("empty"), "--template", lab + "/sheet.yaml", "-o", file("c.yaml")},
         "empty: holds no photograph (jpg, jpeg, png, tif, tiff, bmp, heic, heif, nef, dng, cr2, arw, raf)");
  expect({"camera", file("none"), "--template", lab + "/sheet.yaml", "-o", file("c.yaml")},
         "none: no such file or folder");
  expect({"camera"}, "IMAGES: wanted photographs or a folder of them");
  expect({"camera", lab + "/poses/home"}, "--template: wanted the sheet.yaml of the printed sheet");
  expect({"camera", lab + "/poses/home", "--template", lab + "/sheet.yaml"},
         "wanted -o camera.yaml or --library DIR");
  expect({"camera", lab + "/poses/home", "--template", lab + "/sheet.yaml", "-o", file("c.yaml"),
          "--measured-ruler-mm", "994"},
         "--measured-ruler-mm: found '994', wanted the two 100 mm rulers' lengths as in 99.4x99.7");
}

TEST_F(CommandRefusals, OfACampaignWhoseCameraIsNotCalibrated) {
  fs::remove(file("lab/camera.yaml"));
  for (const char* command : {"measure", "run"}) {
    const CommandResult result = run_hexcal({command, file("lab")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("campaign.yaml: camera: " + file("lab/camera.yaml") +
                                      ": no such file; hexcal camera PHOTOGRAPHS --template SHEET -o " +
                                      file("lab/camera.yaml") + " makes it"));
  }
}

TEST_F(CommandRefusals, OfSheetsAndSimulations) {
  const std::string pdf = file("t.pdf");
  expect({"template", "markers", "--marker-mm", "24", "--gap-mm", "8", "-o", pdf},
         "--ids is missing, wanted ids and ranges such as 0-9,100-109");
  expect({"template", "markers", "--ids", "9-0", "--marker-mm", "24", "--gap-mm", "8", "-o", pdf},
         "--ids: found '9-0', wanted ids and ranges such as 0-9,100-109");
  expect({"template", "chessboard", "-o", pdf},
         "--square-mm is missing, wanted a size in mm: sizes have no default");
  expect({"template", "chessboard", "--square-mm", "20", "--paper", "A9", "-o", pdf},
         "--paper: found 'A9', wanted A4, A3, letter, legal or WIDTHxHEIGHT in mm");
  expect({"template", "chessboard", "--square-mm", "20", "--sheets", "2", "-o", pdf},
         "--sheets: chessboard sheets cannot be told apart by ids");
  expect({"template", "chessboard", "--square-mm", "20", "-o", file("t.yaml")},
         "-o: wanted a name that ends with .pdf");
  expect({"simulate", "-o", file("new"), "--sheet", file("sheets.yaml")},
         "sheets.yaml: holds 2 sheets, wanted the one to photograph");
  expect({"simulate", "-o", file("new"), "--commands", file("poses.csv")},
         "--commands needs --from, the campaign whose machine is to be moved");
}

TEST_F(CommandRefusals, OfExports) {
  expect({"export", file("words.txt"), "--to", "opencv", "-o", file("o.yaml")},
         "words.txt: is no file that can be exported, wanted a camera, a model.yaml, actuators.csv or poses");
  expect({"export", file("lab/camera.yaml"), "--to", "pi-gcs", "-o", file("o.txt")},
         "--to: found 'pi-gcs', wanted one of");
  expect({"export", file("poses.csv"), "--to", "linuxcnc", "-o", file("o.txt")},
         "--to: found 'linuxcnc' for " + file("poses.csv") + ", wanted pi-gcs or csv");
}

TEST_F(CommandRefusals, OfObservationsThatAreNotTheCampaigns) {
  const std::string observations = file("o.txt");
  const auto refused = [&](const std::string& text, const std::string& words) {
    std::ofstream(observations) << text;
    const CommandResult result = run_hexcal({"measure", file("lab"), "--observations", observations});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  refused("observations,1,tag25h9,\n", "o.txt: found family tag25h9, the campaign's is tag36h11");
  refused("observations,1,tag36h11,abc\n", "o.txt: was detected with another camera file than");
  refused("observations,1,tag36h11,\nphotograph,a.jpg,0,ok,,6016,4000,,,,,,,,,,,,\n",
          "o.txt: photograph 'a.jpg': wanted its pose's folder before the name");
}

}  // namespace
}  // namespace hexcal
