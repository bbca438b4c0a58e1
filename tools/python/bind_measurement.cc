#include <pybind11/stl.h>

#include "tools/campaign/campaign_lock.h"
#include "tools/campaign/measure_campaign.h"
#include "tools/python/arrays.h"

namespace hexcal::python {
namespace py = pybind11;
namespace {

struct Measurement {
  std::vector<std::string> ids;
  std::vector<std::string> status;
  std::vector<std::string> words;
  Rows6 poses;
  std::vector<Matrix6d> covariances;  ///< mm and deg
  std::vector<std::string> warnings;
};

Measurement measure(const std::filesystem::path& campaign,
                    const std::optional<std::filesystem::path>& observations, int threads, bool cache,
                    bool interior_fixed) {
  MeasureRequest request;
  request.campaign = campaign;
  request.observations = observations;
  request.threads = threads;
  request.cache = cache;
  request.interior_fixed = interior_fixed;
  OpenCampaign open = open_campaign(request);
  std::optional<CampaignLock> lock;
  if (cache && !observations) lock.emplace(open.results);
  const CampaignResult result = measure_campaign(request, std::move(open)).result;
  Measurement out;
  for (const Finding& finding : result.findings) out.warnings.push_back(finding_text(finding));
  out.poses.setConstant(static_cast<Eigen::Index>(result.poses.size()), 6, std::nan(""));
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    const MeasuredPose& pose = result.poses[i];
    out.ids.push_back(pose.id);
    out.status.emplace_back(pose_status_name(pose.status));
    out.words.push_back(pose.words);
    if (pose.pose) out.poses.row(static_cast<Eigen::Index>(i)) = row_of_pose(*pose.pose);
    out.covariances.push_back(pose.pose ? to_deg(pose.covariance) : Matrix6d::Constant(std::nan("")));
  }
  return out;
}

Rows6 sigmas_of(const Measurement& measurement) {
  Rows6 sigmas(measurement.poses.rows(), 6);
  for (Eigen::Index i = 0; i < sigmas.rows(); ++i) {
    sigmas.row(i) = measurement.covariances[static_cast<std::size_t>(i)].diagonal().cwiseSqrt();
  }
  return sigmas;
}

}  // namespace

void bind_measurement(py::module_& module) {
  py::class_<Measurement>(module, "Measurement", "Measured poses of a campaign, a row per pose.")
      .def_readonly("ids", &Measurement::ids, "Names of the poses' folders.")
      .def_readonly("status", &Measurement::status,
                    "'ok', 'suspect' (measured, but something contradicts it), or the name of what is wrong.")
      .def_readonly("words", &Measurement::words, "Why a pose is not ok, or what should be known of it.")
      .def_readonly("poses", &Measurement::poses, "(N, 6), mm and deg, NaN where there is none.")
      .def_property_readonly(
          "covariances", [](const Measurement& m) { return stack_of(m.covariances); },
          "(N, 6, 6), mm and deg.")
      .def_property_readonly("sigmas", &sigmas_of, "(N, 6), mm and deg.")
      .def_readonly("warnings", &Measurement::warnings, "Findings about the campaign as a whole.");
  module.def("measure", &measure, py::arg("campaign"), py::arg("observations") = std::nullopt, py::kw_only(),
             py::arg("threads") = 0, py::arg("cache") = true, py::arg("interior_fixed") = false,
             py::call_guard<py::gil_scoped_release>(),
             R"(Measures a campaign folder; `observations`: a file of `hexcal detect` instead of photographs.

Writes nothing but results/cache, and not even that with cache=False. threads=0 takes all processors.)");
}

}  // namespace hexcal::python
