#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>
#include <utility>
#include <vector>

#include "kinematics/forward.h"
#include "tests/support/error_matchers.h"
#include "tests/support/hexapods.h"
#include "tests/support/temporary_folder.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_export.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/controller_export.h"
#include "tools/io/csv_table.h"
#include "tools/io/measured_network.h"
#include "tools/io/observation_table.h"
#include "tools/io/observations_file.h"
#include "tools/io/pose_table.h"
#include "tools/io/row_stream.h"
#include "tools/io/sheet_file.h"
#include "tools/io/yaml_map.h"

// What a reader says of each fault that a file can have: one row each, with the place that it names.

namespace hexcal {
namespace {

namespace fs = std::filesystem;

// A good file, in which one thing is replaced before it is read again.
class FaultyFile {
 public:
  FaultyFile(const std::string& name, std::string good, std::function<void(const fs::path&)> read)
      : path_(folder_.path() / name), good_(std::move(good)), read_(std::move(read)) {
    write_file_atomically(path_, good_);
    EXPECT_NO_THROW(read_(path_)) << name;
  }
  void expect(const std::string& from, const std::string& to, const std::string& words) const {
    std::string text = good_;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file_atomically(path_, text.replace(at, from.size(), to));
    EXPECT_THAT([this] { read_(path_); }, ThrowsInputError(words)) << to;
  }
  [[nodiscard]] const fs::path& path() const { return path_; }
  [[nodiscard]] fs::path folder() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
  fs::path path_;
  std::string good_;
  std::function<void(const fs::path&)> read_;
};

TEST(Refusals, OfYamlNameLineAndKey) {
  const YamlMap map = YamlMap::parse(
      "half: 1.5\npair: [1, 2]\nword: text\nmixed: [{g: 1}, two]\npoints: [[1, 2, 3], [1, 2]]\n"
      "places: [[1, 2, x]]\nnested: {inner: [1, y]}\n",
      "f.yaml");
  const std::vector<std::pair<std::function<void()>, const char*>> faults{
      {[&] { (void)map.integer("half"); }, "f.yaml:1: half: found '1.5', wanted a whole number"},
      {[&] { (void)map.boolean_or("word", true); }, "f.yaml:3: word: found 'text', wanted true or false"},
      {[&] { (void)map.text("pair"); }, "f.yaml:2: pair: found a list of 2, wanted a text"},
      {[&] { (void)map.numbers("word", 0); }, "wanted a list of numbers"},
      {[&] { (void)map.numbers("pair", 3); }, "wanted a list of 3 numbers"},
      {[&] { (void)map.map("nested").numbers("inner", 2); },
       "f.yaml:7: nested.inner: found 'y', wanted a number"},
      {[&] { (void)map.vectors3("word", 2); }, "wanted a list of 2 [x, y, z]"},
      {[&] { (void)map.vectors3("points", 0); }, "wanted [x, y, z]"},
      {[&] { (void)map.vectors3("places", 0); }, "found 'x', wanted a number"},
      {[&] { (void)map.texts("word"); }, "f.yaml:3: word: found 'text', wanted a list"},
      {[&] { (void)map.texts("mixed"); }, "wanted a single value"},
      {[&] { (void)map.map("word"); }, "wanted keys and values"},
      {[&] { (void)map.maps("word"); }, "f.yaml:3: word: found 'text', wanted a list"},
      {[&] { (void)map.maps("mixed"); }, "found 'two', wanted keys and values"},
      {[&] {
         (void)map.choice("word", {"a", "b"});
       },
       "found 'text', wanted one of a, b"},
      {[&] { (void)map.text("wort"); }, "missing, wanted a text; 'word' in line 3 looks like it"},
      {[&] { (void)map.number("nested"); }, "f.yaml:7: nested: found a mapping, wanted a number"},
      {[&] { map.map("nested").finish(); }, "unknown key 'nested.inner'"},
      {[] { (void)YamlMap::parse("[1, 2]: 3\n", "f.yaml").keys(); }, "f.yaml:1: a key is not a single value"},
      {[] { (void)YamlMap::parse(std::string(20 << 20, ' '), "f.yaml"); }, "bytes, wanted at most"},
      {[] { (void)YamlMap::parse("a: " + std::string(40, '[') + std::string(40, ']'), "f.yaml"); }, "deep"}};
  for (const auto& [fault, words] : faults) EXPECT_THAT(fault, ThrowsInputError(words));
}

TEST(Refusals, OfACampaign) {
  const FaultyFile file(
      "campaign.yaml",
      "camera: camera.yaml\nimages: poses\nmarkers:\n  family: tag36h11\n  fixed: {ids: [0-9], size_mm: "
      "24.0}\n"
      "  moving: {ids: {100: 24, 101-103: 12.5}}\nframes:\n  UG: {from: features, z: {plane: [0, 1, 2]}, x: "
      "{line: [0, 3]}, origin: {point: 4}}\n  LG: {from: home, pose: home, gd_mm: 50}\nscale: {from: "
      "markers, "
      "print_scale_sigma: 0.001}\nchecks: [{a: 0, b: 1, length_mm: 30, sigma_mm: 0.1}]\n",
      [](const fs::path& path) { (void)read_campaign(path); });
  const std::string bar = "{bars: [{a: 0, b: 1, length_mm: 30, sigma_mm: 0.01}]";
  file.expect("[0-9]", "[0-x]",
              "campaign.yaml:5: markers.fixed.ids: found '0-x', wanted an id or a range such as 0-9");
  file.expect("[0-9]", "[]", "markers.fixed.ids: is empty, wanted at least one marker");
  file.expect("24.0", "-24", "markers.fixed.size_mm: found -24, wanted more than 0");
  file.expect("plane: [0, 1, 2]", "plane: []", "frames.UG.z.plane: is empty, wanted markers or corners");
  file.expect("{plane: [0, 1, 2]}", "{plane: [0, 1, 2], line: [0, 1]}",
              "frames.UG.z: found 2 features, wanted one of");
  file.expect("{point: 4}", "{point: vier}", "found 'vier', wanted a marker id or id.corner");
  file.expect("gd_mm: 50", "gd_mm: -5", "frames.LG.gd_mm: found -5, wanted 0 or more");
  file.expect("print_scale_sigma: 0.001", "print_scale_sigma: -1",
              "scale.print_scale_sigma: found -1, wanted 0 or more");
  file.expect("{from: markers, print_scale_sigma: 0.001}", "{bars: []}",
              "scale.bars: missing, wanted at least one");
  file.expect("{from: markers, print_scale_sigma: 0.001}", "{bars: [{a: 0, b: 1, length_mm: 30}]}",
              "scale.bars: sigma_mm is missing or 0, wanted how well each bar is known");
  file.expect("{from: markers, print_scale_sigma: 0.001}", bar + ", from: nominal}",
              "scale.from: found 'nominal', but no frame is from nominal coordinates");
  file.expect("b: 1, length_mm", "b: 0, length_mm", "checks[0].b: is the same point as a");
  file.expect("  LG: {from: home, pose: home, gd_mm: 50}\n", "",
              "wanted UG and LG, since there are moving markers");
  file.expect("camera: camera.yaml", "camera: []", "campaign.yaml:1: camera: is empty, wanted a camera file");
  fs::create_directory(file.folder() / "lenses");
  file.expect("camera.yaml", "lenses", "lenses holds no camera file (.yaml)");
}

TEST(Refusals, OfNominalPointsAndTheTableOfImages) {
  const FaultyFile points("nominal.csv",
                          "id,corner,x_mm,y_mm,z_mm,sigma_mm\n0,0,1,2,3,0.01\n0,1,2,2,3,\n1,,5,5,5,0.02\n",
                          [](const fs::path& path) { (void)read_nominal_points(path); });
  points.expect("\n0,1,", "\n0,4,", "nominal.csv:3: column 'corner': wanted 0 to 3");
  points.expect("\n0,1,", "\n0,0,", "nominal.csv:3: column 'id': this point stands twice");
  points.expect("0.02", "0", "nominal.csv:4: column 'sigma_mm': wanted more than 0");
  points.expect("1,,5,5,5,0.02\n", "", "nominal.csv: 2 points, wanted at least 3");
  points.expect("1,,5", "1.5,,5", "nominal.csv:4: column 'id': '1.5' is not a whole number");
  const FaultyFile images("images.csv", "file,pose\na.jpg,home\n",
                          [](const fs::path& path) { (void)read_images_table(path); });
  images.expect("a.jpg,", ",", "images.csv:2: column 'file': is empty, wanted a file name");
  images.expect(",home", ",", "images.csv:2: column 'pose': is empty, wanted a pose id");
  images.expect("file,pose", "file,file", "images.csv:1: column 'file' stands twice");
  images.expect("a.jpg,home", std::string(2000, ','), "images.csv:2: no CSV table: more than 1000 fields");
  images.expect("a.jpg", std::string(std::size_t{2} << 20, 'a'), "or one of more than 1048576 bytes");
}

TEST(Refusals, OfACameraFile) {
  CalibratedCamera camera;
  camera.model = CameraModel(6016, 4000, 9000, LensModel::brown);
  const FaultyFile file("camera.yaml", format_camera_file("", camera),
                        [](const fs::path& path) { (void)read_camera_file(path); });
  file.expect("f_px: ", "f_px: -", "camera.yaml:");
  file.expect("f_px: ", "f_px: -", "parameters.f_px: found -9000, wanted a positive focal length");
  file.expect("[6016, 4000]", "[6016, 4000.5]",
              "image_size_px: found 4000.5, wanted whole numbers from 16 to 65535");
  file.expect("model: brown", "model: fisheye", "wanted one of brown, rational, radial");
  const Eigen::Index count = camera.model.parameters.size();
  camera.covariance = Eigen::MatrixXd::Identity(count, count);
  const FaultyFile sigmas("sigmas.yaml", format_camera_file("", camera),
                          [](const fs::path& path) { (void)read_camera_file(path); });
  sigmas.expect("f_px: [1,", "f_px: [-1,", "covariance.f_px: variance -1 is negative");
}

TEST(Refusals, OfAnotherProgramsCamera) {
  const auto read = [](const fs::path& path) { (void)read_foreign_camera(path); };
  const FaultyFile opencv(
      "opencv.yaml",
      "image_width: 640\nimage_height: 480\ncamera_matrix: {data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}\n"
      "distortion_model: plumb_bob\ndistortion_coefficients: {data: [0.1, 0, 0, 0, 0]}\n",
      read);
  opencv.expect("640", "64000000", "image_width: found 64000000, wanted a whole number from");
  opencv.expect("[500,", "[-500,", "opencv.yaml: wanted a positive focal length and numbers of a camera");
  opencv.expect("[0.1, 0, 0, 0, 0]", "[0.1, 0]", "found 2 coefficients, wanted 4, 5, 8 or 12");
  opencv.expect("plumb_bob", "equidistant", "wanted one of plumb_bob, rational_polynomial");
  const FaultyFile photomodeler("pm.yaml",
                                "image_size_px: [6016, 4000]\nphotomodeler: {focal_mm: 35, "
                                "principal_point_mm: [11.6, 7.7], format_mm: [23.2, "
                                "15.4], k: [0, 0, 0], p: [0, 0]}\n",
                                read);
  photomodeler.expect("focal_mm: 35", "focal_mm: 0", "photomodeler: wanted positive focal_mm and format_mm");
  photomodeler.expect("k: [0, 0, 0]", "k: [1, 1, 1]", "k and p move a point of the frame by");
  photomodeler.expect("k: [0, 0, 0]", "k: [-4.0e-3, 0, 0]", "no Brown camera has these values");
}

TEST(Refusals, OfASheet) {
  const FaultyFile sheet(
      "sheet.yaml", "kind: markers\nfamily: tag36h11\nids: [0-3]\ncolumns: 4\nsize_mm: 24\nspacing_mm: 8\n",
      [](const fs::path& path) { (void)read_sheet_file(path); });
  sheet.expect("columns: 4", "columns: 0", "columns: found 0, wanted at least 1");
  sheet.expect("0-3", "0-x", "ids: found '0-x', wanted an id or a range such as 0-9");
  sheet.expect("0-3", "3-0", "ids: found '3-0', wanted an id or a range such as 0-9");
  sheet.expect("size_mm: 24", "size_mm: 0", "size_mm: found 0, wanted more than 0 mm");
  sheet.expect("tag36h11", "tag0h0", "marker family 'tag0h0' is not known; wanted one of");
  sheet.expect("0-3", "0-3, 2", "id 2 stands twice, wanted each id once");
  sheet.expect("0-3", "5000", "id 5000 is not in tag36h11, which has ids 0 to 586");
  const std::string list =
      "  - {kind: markers, family: tag36h11, ids: [0-3], columns: 4, size_mm: 24, spacing_mm: 8}\n";
  const FaultyFile sheets("sheets.yaml", "sheets:\n" + list,
                          [](const fs::path& path) { (void)read_sheet_file(path); });
  sheets.expect(list, list + list, "sheets.yaml: id 0 of tag36h11 stands on two sheets, wanted distinct ids");
  sheets.expect("\n" + list, " []\n", "sheets.yaml: no sheets, wanted at least one");
}

TEST(Refusals, OfAController) {
  const PlatformGeometry frames = surrogate_hexapod();
  for (const char* line : {"setp genhexkins.base.6.x 1", "setp genhexkins.base.0.w 1",
                           "setp genhexkins.base.0 1", "setp lineardeltakins.R 1"})
    EXPECT_THAT([&] { (void)parse_linuxcnc(line, frames); }, ThrowsInputError("no such pin")) << line;
  EXPECT_THAT([&] { (void)parse_linuxcnc("setp genhexkins.base.0.x one", frames); },
              ThrowsInputError("wanted setp PIN NUMBER"));
  EXPECT_THAT([] { (void)parse_pi_gcs("MOV X 1 Z 2\n"); },
              ThrowsInputError("'MOV X 1 Z 2': wanted MOV X .. W"));
}

TEST(Refusals, OfMarkerObservations) {
  MarkerObservation marker;
  marker.id = 7;
  for (Eigen::Vector2d& corner : marker.corners_px) corner.setZero();
  marker.covariance_px2.setIdentity();
  PhotographObservations photograph;
  photograph.name = "a.jpg";
  photograph.info.vibration_reduction = true;
  photograph.markers = {marker};
  const std::string good = observations_text({"tag36h11", "abc", {photograph}});
  const FaultyFile file("o.txt", good, [](const fs::path& path) { (void)read_observations(path); });
  file.expect("marker,7", "marker,-7", "found id -7, wanted none below 0");
  file.expect("marker,7", "marker,7.5", "wanted a whole number");
  file.expect("marker,7", "maker,7", "found a record 'maker', wanted photograph or marker");
  file.expect("a.jpg", "\"a\"b.jpg", "text after a quote");
  file.expect(",1\nmarker", ",2\nmarker", "found 2, wanted 0 or 1");
  file.expect("marker,7,", "marker,7,ok,", "found 53 fields in a marker record, wanted 52");
}

TEST(Refusals, OfPosesAndReadings) {
  const TemporaryFolder folder;
  const PlatformGeometry nominal = surrogate_hexapod();
  const std::string names = "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg";
  const fs::path targets = folder.path() / "targets.csv";
  write_file_atomically(targets, names + "\na,10,0,0,0,2,0\nb,0,10,0,2,0,0\nc,0,0,10,0,0,2\n");
  const auto read = [&](const fs::path& path) {
    (void)read_observations(
        nominal, {.poses = path, .targets = targets, .legs = std::nullopt, .covariance = std::nullopt}, {});
  };
  const FaultyFile poses(
      "poses.csv",
      names +
          ",sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg\n"
          "a,10,0,0,0,2,0,.1,.1,.1,.1,.1,.1\nb,0,10,0,2,0,0,.1,.1,.1,.1,.1,.1\n"
          "c,0,0,10,0,0,2,.1,.1,.1,.1,.1,.1\n",
      read);
  poses.expect("a,10,0,0,0,2,0,.1", "a,10,0,0,0,2,0,-1",
               "poses.csv:2: column 'sigma_x_mm': found -1, wanted 0 or more");
  poses.expect("\na,", "\n,", "poses.csv:2: column 'pose': is empty, wanted a pose id");
  poses.expect("a,10,0,0,0,2,0,", "a,,,,,,,",
               "poses.csv:2: column 'pose': pose 'a' has no coordinate, wanted at least one");
  write_file_atomically(folder.path() / "failed.csv",
                        "pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\na,ok,10,0,0,0,2,0\n"
                        "b,no_photographs,,,,,,\nc,suspect: why,0,0,10,0,0,2\n");
  const ObservationFiles with_failed{.poses = folder.path() / "failed.csv",
                                     .targets = targets,
                                     .legs = std::nullopt,
                                     .covariance = std::nullopt};
  const ObservationTable table = read_observations(nominal, with_failed, {});
  ASSERT_EQ(table.left_out.size(), 2U);
  EXPECT_EQ(table.left_out[0].id, "b");
  EXPECT_EQ(table.left_out[0].reason, "not measured: no_photographs");
  EXPECT_EQ(table.left_out[1].reason, "suspect: why");
  ObservationDefaults asked;
  asked.with_suspect = true;
  const ObservationTable with_suspect = read_observations(nominal, with_failed, asked);
  ASSERT_EQ(with_suspect.observations.poses.size(), 2U);
  EXPECT_EQ(with_suspect.observations.poses[1].id, "c");
  const auto scaled = [&](const char* mm, const char* deg, const std::string& words) {
    const fs::path path = folder.path() / "scaled.csv";
    write_file_atomically(
        path, fmt::format("{0}\na,{1},0,0,0,{2},0\nb,0,{1},0,{2},0,0\nc,0,0,{1},0,0,{2}\n", names, mm, deg));
    EXPECT_THAT([&] { read(path); }, ThrowsInputError(words));
  };
  scaled("0.01", "2", "positions are 1000 times smaller than the targets, metres? wanted mm");
  scaled("10000", "2", "positions are 1000 times larger than the targets, wanted both in mm");
  scaled("10", "0.0349", "angles are 57 times smaller than the targets, radians? wanted deg");
  scaled("10", "114.6", "angles are 57 times larger than the targets, wanted both in deg");
  EXPECT_THAT(
      [&] {
        (void)read_observations(
            nominal,
            ObservationFiles{
                .poses = targets, .targets = std::nullopt, .legs = std::nullopt, .covariance = std::nullopt},
            {});
      },
      ThrowsInputError("measured poses need the targets or the readings at which they were taken"));

  const fs::path legs = folder.path() / "legs.csv";
  write_file_atomically(legs,
                        "pose,q1,q2,q3,q4,q5,q6,approach1,approach2,approach3,approach4,approach5,approach6\n"
                        "a,480,480,480,480,480,480,1,1,2,0,0,0\n");
  const ObservationFiles with_legs{
      .poses = targets, .targets = std::nullopt, .legs = legs, .covariance = std::nullopt};
  EXPECT_THAT([&] { (void)read_observations(nominal, with_legs, {}); },
              ThrowsInputError("legs.csv:2: column 'approach3': found 2, wanted -1, 0 or 1"));
  const fs::path covariance = folder.path() / "covariance.csv";
  std::string head = "pose_a,pose_b";
  for (int r = 1; r <= 6; ++r)
    for (int c = 1; c <= 6; ++c) head += fmt::format(",c{}{}", r, c);
  write_file_atomically(covariance, head + "\n");
  const ObservationFiles with_covariance{
      .poses = targets, .targets = targets, .legs = std::nullopt, .covariance = covariance};
  EXPECT_THAT([&] { (void)read_observations(nominal, with_covariance, {}); },
              ThrowsInputError("covariance.csv: no row for pose 'a' with itself"));
}

TEST(Refusals, OfAMeasuredNetwork) {
  const TemporaryFolder folder;
  const std::string names = "photo,pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";
  write_file_atomically(folder.path() / "photos.csv", names + "a.jpg,home,,,,,,\n");
  EXPECT_THAT([&] { (void)read_measured_network(folder.path()); },
              ThrowsInputError("photos.csv: no photograph has a place"));
  write_file_atomically(folder.path() / "photos.csv", names + "a.jpg,home,1,2,3,0,0,0\n");
  write_file_atomically(folder.path() / "markers.csv", "id,corner,frame,x_mm,y_mm,z_mm\n7,0,LG,1,2,3\n");
  EXPECT_THAT([&] { (void)read_measured_network(folder.path()); },
              ThrowsInputError("markers.csv: no marker of LG with four corners"));
}

TEST(Refusals, OfRowsThatStreamThrough) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "out.csv";
  RowTransform transform;
  transform.columns = {"q1"};
  transform.header = "pose\n";
  transform.row = [](const StreamedRow& row, std::string& text) {
    text += std::string(row.id) + "\n";
    return true;
  };
  const auto read = [&](const fs::path& path) { (void)stream_rows(path, out, "# head", transform, 2); };
  const FaultyFile rows("rows.csv", "pose,q1\na,1\nb,2\nc,3\n", read);
  fs::remove(out);
  rows.expect("b,2", "b,two", "rows.csv:3: q1: found 'two', wanted a number");
  rows.expect("b,2", "b", "rows.csv:3: found 1 fields, wanted 2 as in the header");
  rows.expect("b,2", ",2", "rows.csv:3: pose: is empty, wanted a pose id");
  rows.expect("pose,q1", "pose,q2", "rows.csv:1: found columns pose,q2, wanted a column 'q1'");
  rows.expect("pose,q1\na,1\nb,2\nc,3\n", "# nothing\n", "rows.csv: is empty, wanted a header line");
  rows.expect("b,2", std::string(std::size_t{40} << 20, 'b'), "the line is too long");
  EXPECT_THAT([&] { read(folder.path() / "none.csv"); }, ThrowsInputError("none.csv: no such file"));
  EXPECT_THAT([&] { read(folder.path()); }, ThrowsInputError("is a folder, wanted a file"));
  EXPECT_FALSE(fs::exists(out));
  fs::create_directory(out);
  write_file_atomically(rows.path(), "pose,q1\na,1\n");
  EXPECT_THAT([&] { read(rows.path()); },
              ThrowsInputError("out.csv: is a folder, wanted a file name to write"));
}

TEST(Refusals, OfFilesThatCannotBeReadOrWritten) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "file", "pose,q1\na,1\n");
  const fs::path inside = folder.path() / "file" / "out.csv";
  EXPECT_THAT([&] { write_file_atomically(inside, ""); }, ThrowsInputError("file: cannot create: "));
  RowTransform transform;
  transform.columns = {"q1"};
  transform.row = [](const StreamedRow&, std::string&) { return true; };
  EXPECT_THAT([&] { (void)stream_rows(folder.path() / "file", inside, "#", transform, 1); },
              ThrowsInputError("file: cannot create: Not a directory"));
  EXPECT_THAT([] { (void)read_file("/proc/self/mem"); },
              ThrowsInputError("/proc/self/mem: belongs to the kernel"));
  fs::create_directory(folder.path() / "elsewhere");
  fs::create_directory_symlink("elsewhere", folder.path() / "results");
  EXPECT_THAT([&] { refuse_linked_folders(folder.path() / "results"); },
              ThrowsInputError("results: is a link, wanted a folder"));
}

// As a full disk would answer, but for this process alone.
TEST(Refusals, OfADiskThatIsFull) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "out.csv";
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit unlimited{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &unlimited), 0);
  const rlimit little{1000, unlimited.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  std::string said;
  try {
    write_file_atomically(path, std::string(2000, 'x'));
  } catch (const InputError& error) {
    said = error.what();
  }
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &unlimited), 0);
  std::signal(SIGXFSZ, before);
  EXPECT_THAT(said, ::testing::HasSubstr("out.csv: cannot write: File too large"));
  EXPECT_TRUE(fs::is_empty(folder.path())) << "half a file was left";
}

TEST(Refusals, OfAFileThatHoldsTooMuch) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "huge.csv";
  write_file_atomically(path, "pose\n");
  fs::resize_file(path, std::uintmax_t{1} << 40);  // without a block on the disk
  EXPECT_THAT([&] { (void)CsvTable::read(path); }, ThrowsInputError("huge.csv: holds more than"));
}

}  // namespace
}  // namespace hexcal
