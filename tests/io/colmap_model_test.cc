#include "tools/io/colmap_model.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <map>
#include <sstream>

#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

// COLMAP's own rules of reading: '#' lines are comments, an image takes two lines.
std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind('#', 0) != 0) lines.push_back(line);
  }
  return lines;
}

// FULL_OPENCV with pixel (0, 0) at the corner of the first pixel.
Eigen::Vector2d full_opencv(const std::vector<double>& p, const Eigen::Vector3d& at) {
  const double x = at.x() / at.z();
  const double y = at.y() / at.z();
  const double r2 = x * x + y * y;
  const double radial =
      (1 + r2 * (p[4] + r2 * (p[5] + r2 * p[8]))) / (1 + r2 * (p[9] + r2 * (p[10] + r2 * p[11])));
  return {p[0] * (x * radial + 2 * p[6] * x * y + p[7] * (r2 + 2 * x * x)) + p[2],
          p[1] * (y * radial + 2 * p[7] * x * y + p[6] * (r2 + 2 * y * y)) + p[3]};
}

TEST(ColmapModel, EveryObservationIsTheProjectionOfItsPointAndStandsInItsTrack) {
  ObservationSceneOptions options;
  options.num_epochs = 3;
  const CampaignScene made = make_campaign_scene(options);
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  std::map<std::string, std::string> files;
  for (const auto& [name, text] : format_colmap_model(made.observations, result)) files[name] = text;

  std::istringstream camera(lines_of(files.at("cameras.txt")).at(0));
  std::string id;
  std::string model;
  int width = 0;
  int height = 0;
  camera >> id >> model >> width >> height;
  EXPECT_EQ(model, "FULL_OPENCV");
  std::vector<double> parameters;
  for (double value = 0; camera >> value;) parameters.push_back(value);
  ASSERT_EQ(parameters.size(), 12U);

  std::map<int, Eigen::Vector3d> points;
  std::map<std::pair<int, int>, int> point_at;  // (image, index) -> point, by the tracks
  for (const std::string& line : lines_of(files.at("points3D.txt"))) {
    std::istringstream in(line);
    int number = 0;
    int red = 0;
    int green = 0;
    int blue = 0;
    double error = 0;
    Eigen::Vector3d at;
    in >> number >> at.x() >> at.y() >> at.z() >> red >> green >> blue >> error;
    EXPECT_TRUE(points.emplace(number, at).second) << "point stands twice";
    int image = 0;
    int index = 0;
    int length = 0;
    for (; in >> image >> index; ++length) point_at[{image, index}] = number;
    EXPECT_GE(length, 1);
  }
  EXPECT_EQ(points.size(), 40U + 3 * 40U);

  const std::vector<std::string> images = lines_of(files.at("images.txt"));
  ASSERT_EQ(images.size(), 2 * made.observations.photographs.size());
  std::size_t observations = 0;
  for (std::size_t i = 0; i < images.size(); i += 2) {
    std::istringstream head(images[i]);
    int image = 0;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    head >> image >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z();
    std::istringstream in(images[i + 1]);
    Eigen::Vector2d px;
    int point = 0;
    for (int index = 0; in >> px.x() >> px.y() >> point; ++index, ++observations) {
      EXPECT_EQ(point_at.at({image, index}), point);
      EXPECT_LT((full_opencv(parameters, q * points.at(point) + t) - px).norm(), 1e-3);
    }
  }
  EXPECT_EQ(observations, point_at.size());
}

}  // namespace
}  // namespace hexcal
