#include <fmt/format.h>
#include <pybind11/stl.h>

#include "calibration/calibrate.h"
#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"
#include "tools/io/model_file.h"
#include "tools/io/observation_table.h"
#include "tools/io/version.h"
#include "tools/python/arrays.h"

namespace hexcal::python {
namespace py = pybind11;
namespace {

namespace fs = std::filesystem;
using Covariances = py::array_t<double, py::array::c_style | py::array::forcecast>;

constexpr double kGuessedSigmaMm = 0.1;  // only their ratio matters: identification estimates both
constexpr double kGuessedSigmaDeg = 0.03;

void want_rows(Eigen::Index found, Eigen::Index wanted, const char* name) {
  if (found != wanted) throw InputError(fmt::format("{}: found {} rows, wanted {}", name, found, wanted));
}

ObservationSet observations_of(const RowsIn& measured, const RowsIn& readings,
                               const std::optional<Covariances>& covariances,
                               const std::optional<RowsIn>& targets,
                               const std::optional<std::vector<std::string>>& ids) {
  const Eigen::Index n = measured.rows();
  want_rows(readings.rows(), n, "readings");
  if (targets) want_rows(targets->rows(), n, "targets");
  if (ids) want_rows(static_cast<Eigen::Index>(ids->size()), n, "ids");
  if (covariances && (covariances->ndim() != 3 || covariances->shape(0) != n || covariances->shape(1) != 6 ||
                      covariances->shape(2) != 6)) {
    throw InputError(fmt::format("covariances: found another shape, wanted ({}, 6, 6)", n));
  }
  ObservationSet set;
  set.covariance_known = covariances.has_value();
  for (Eigen::Index i = 0; i < n; ++i) {
    PoseObservation pose;
    pose.id = ids ? (*ids)[static_cast<std::size_t>(i)] : std::to_string(i);
    Vector6d row = measured.row(i).transpose();
    int seen = 0;
    for (Eigen::Index k = 0; k < 6; ++k) {
      pose.observed[static_cast<std::size_t>(k)] = std::isfinite(row[k]);
      seen += std::isfinite(row[k]) ? 1 : 0;
      if (!std::isfinite(row[k])) row[k] = 0;
    }
    if (seen == 0 || !readings.row(i).allFinite()) continue;
    pose.measured = pose_of_row(row);
    pose.readings = readings.row(i).transpose();
    if (targets && targets->row(i).allFinite()) pose.target = pose_of_row(targets->row(i).transpose());
    if (covariances) {
      pose.covariance =
          to_rad(Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariances->data(i, 0, 0)));
      if (!pose.covariance.allFinite())
        throw InputError(fmt::format("covariances: pose {} is not finite", pose.id));
      pose.is_definition = pose.covariance.isZero(0) && pose.measured.vector().isZero(0);
    } else {
      const double rad = kGuessedSigmaDeg * kRadPerDeg;
      Vector6d variance;
      variance << Eigen::Vector3d::Constant(kGuessedSigmaMm * kGuessedSigmaMm),
          Eigen::Vector3d::Constant(rad * rad);
      pose.covariance = variance.asDiagonal();
    }
    set.poses.push_back(std::move(pose));
  }
  if (set.poses.empty()) throw InputError("measured, readings: no row has both, wanted at least one");
  return set;
}

Rows6 rows_of(const ObservationSet& set,
              const std::function<std::optional<Vector6d>(const PoseObservation&)>& row) {
  Rows6 rows(static_cast<Eigen::Index>(set.poses.size()), 6);
  for (std::size_t i = 0; i < set.poses.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = row(set.poses[i]).value_or(Vector6d::Constant(std::nan("")));
  }
  return rows;
}

Rows6 model_inverse(const CalibrationModel& model, const RowsIn& poses) {
  Rows6 readings(poses.rows(), 6);
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    readings.row(i) = readings_for_pose(model, pose_of_row(poses.row(i).transpose()))
                          .value_or(LegVector::Constant(std::nan("")));
  }
  return readings;
}

Rows6 model_forward(const CalibrationModel& model, const RowsIn& readings) {
  Rows6 poses(readings.rows(), 6);
  for (Eigen::Index i = 0; i < readings.rows(); ++i) {
    const std::optional<Pose> pose = pose_for_readings(model, readings.row(i).transpose());
    poses.row(i) = pose ? row_of_pose(*pose) : Vector6d(Vector6d::Constant(std::nan("")));
  }
  return poses;
}

struct Commands {
  std::vector<std::string> status;
  Rows6 readings;
  Rows6 predicted;
  Rows6 sigmas;
};

std::vector<Target> targets_of(const RowsIn& targets) {
  std::vector<Target> wanted;
  for (Eigen::Index i = 0; i < targets.rows(); ++i)
    wanted.push_back({std::to_string(i), pose_of_row(targets.row(i).transpose())});
  return wanted;
}

Commands rows_of_commands(const std::vector<CorrectedCommand>& corrected) {
  Commands out;
  for (Rows6* rows : {&out.readings, &out.predicted, &out.sigmas})
    rows->setConstant(static_cast<Eigen::Index>(corrected.size()), 6, std::nan(""));
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const CorrectedCommand& command = corrected[i];
    const bool ok = command.status == CommandStatus::ok;
    out.status.push_back(ok ? "ok" : command.reason);
    if (ok && command.readings) out.readings.row(row) = *command.readings;
    if (ok && command.predicted) out.predicted.row(row) = row_of_pose(*command.predicted);
    if (command.sigma) out.sigmas.row(row) = to_deg(*command.sigma);
  }
  return out;
}

Commands commands_for(const CalibrationModel& model, const RowsIn& targets,
                      const IdentifyResult* identified) {
  return rows_of_commands(compensate(model, targets_of(targets), identified));
}

struct Identified {
  IdentifyResult result;
  CalibrationModel model;
  std::vector<ParameterReport> parameters;
};

Identified identify_machine(const PlatformGeometry& machine, const ObservationSet& observations,
                            bool frames_unknown, bool geometry, bool scales, int curve_terms, bool sag,
                            const std::set<std::string>& fixed, bool robust) {
  IdentifyOptions options;
  options.frames_unknown = frames_unknown;
  options.geometry = geometry;
  options.scales = scales;
  options.curve_terms = curve_terms;
  options.sag = sag;
  options.fixed = fixed;
  options.robust = robust;
  Identified out;
  out.result = identify(machine, observations, options);
  if (out.result.status != IdentifyStatus::identified) throw InputError(out.result.reason);
  out.model.method = CompensationMethod::kinematic;
  out.model.nominal = machine;
  out.model.machine = out.result.machine;
  out.parameters = judge_identifiability(machine, out.result).parameters;
  return out;
}

struct Compensation {
  CalibrationReport report;
};

py::list methods_of(const Compensation& compensation) {
  py::list rows;
  for (const CrossValidation& method : compensation.report.comparison.methods) {
    py::dict row;
    row["name"] = method.name;
    row["numbers"] = method.complexity;
    row["failure"] = method.failure;
    row["errors"] = method.errors;
    row["targets_lost"] = method.targets_lost;
    rows.append(row);
  }
  return rows;
}

void bind_observations(py::module_& module) {
  py::class_<ObservationSet>(module, "Observations",
                             R"(Measured poses and the readings at which they were taken.

measured (N, 6) in mm and deg, NaN for a coordinate that was not measured; readings (N, 6) in actuator units;
covariances (N, 6, 6) in mm and deg, without them the noise is estimated; targets (N, 6): what was commanded.
A measured pose of zeros with a covariance of zeros is the home that defines the frame LG.)")
      .def(py::init(&observations_of), py::arg("measured"), py::arg("readings"), py::kw_only(),
           py::arg("covariances") = std::nullopt, py::arg("targets") = std::nullopt,
           py::arg("ids") = std::nullopt)
      .def_static(
          "read",
          [](const PlatformGeometry& machine, const fs::path& poses, const std::optional<fs::path>& targets,
             const std::optional<fs::path>& legs, const std::optional<fs::path>& covariance) {
            return read_observations(machine, {poses, targets, legs, covariance}).observations;
          },
          py::arg("machine"), py::arg("poses"), py::arg("targets") = std::nullopt,
          py::arg("legs") = std::nullopt, py::arg("covariance") = std::nullopt,
          "From poses.csv with targets.csv or legs.csv, joined by the poses' names.")
      .def("__len__", [](const ObservationSet& set) { return set.poses.size(); })
      .def_property_readonly("ids",
                             [](const ObservationSet& set) {
                               std::vector<std::string> ids;
                               for (const PoseObservation& pose : set.poses) ids.push_back(pose.id);
                               return ids;
                             })
      .def_property_readonly("measured",
                             [](const ObservationSet& set) {
                               return rows_of(
                                   set, [](const PoseObservation& p) { return row_of_pose(p.measured); });
                             })
      .def_property_readonly("readings",
                             [](const ObservationSet& set) {
                               return rows_of(set, [](const PoseObservation& p) { return p.readings; });
                             })
      .def_property_readonly("targets", [](const ObservationSet& set) {
        return rows_of(set, [](const PoseObservation& p) {
          return p.target ? std::optional<Vector6d>(row_of_pose(*p.target)) : std::nullopt;
        });
      });
}

void bind_model(py::module_& module) {
  py::class_<Commands>(module, "Commands", "Corrected commands, a row per target; NaN where there is none.")
      .def_readonly("status", &Commands::status, "'ok', or why the target cannot be reached.")
      .def_readonly("readings", &Commands::readings, "(N, 6), for the actuators.")
      .def_readonly("predicted", &Commands::predicted,
                    "(N, 6), mm and deg: for a controller that knows the nominal machine.")
      .def_readonly("sigmas", &Commands::sigmas,
                    "(N, 6), mm and deg: error that remains, where it is known.");
  py::class_<CalibrationModel>(module, "Model", "What compensation learned about a machine (model.yaml).")
      .def_property_readonly("method", [](const CalibrationModel& m) { return std::string(name(m.method)); })
      .def_readonly("nominal", &CalibrationModel::nominal, "What the controller knows.")
      .def_property_readonly(
          "machine", [](const CalibrationModel& m) { return m.machine.geometry; },
          "The geometry as identified (method kinematic).")
      .def("inverse", &model_inverse, py::arg("poses"),
           "Readings (N, 6) at which the machine stands at poses (N, 6).")
      .def("forward", &model_forward, py::arg("readings"),
           "Poses (N, 6) at which the machine stands at readings (N, 6).")
      .def(
          "correct", [](const CalibrationModel& m, const RowsIn& t) { return commands_for(m, t, nullptr); },
          py::arg("targets"), "Commands that reach targets (N, 6), checked against strokes and joints.")
      .def(
          "save",
          [](const CalibrationModel& model, const fs::path& path) {
            write_file_atomically(path, model_text(fmt::format("# hexcal {} python\n", kVersion), model));
          },
          py::arg("path"));
  module.def("read_model", &read_model_file, py::arg("path"), "Model of a model.yaml.");
}

}  // namespace

void bind_calibration(py::module_& module) {
  bind_observations(module);
  bind_model(module);
  py::class_<Identified>(module, "Identified", "A machine identified from measured poses.")
      .def_readonly("model", &Identified::model)
      .def_property_readonly(
          "sigma0", [](const Identified& i) { return i.result.sigma0; },
          "1 when residuals are as large as their sigmas say.")
      .def_property_readonly(
          "leg_sigma_mm", [](const Identified& i) { return i.result.leg_sigma_mm; },
          "Noise of a leg beyond that of the measurement.")
      .def_property_readonly(
          "parameters",
          [](const Identified& i) {
            py::list rows;
            for (const ParameterReport& p : i.parameters)
              rows.append(py::make_tuple(p.name, p.value, p.sigma, p.unit));
            return rows;
          },
          "(name, correction of the nominal value, sigma, unit) of each.")
      .def_property_readonly(
          "covariance", [](const Identified& i) { return i.result.covariance; },
          "Of the free parameters, mm, rad and ratios.")
      .def_property_readonly(
          "pose_residuals",
          [](const Identified& i) {
            Rows6 rows(static_cast<Eigen::Index>(i.result.pose_residuals.size()), 6);
            for (std::size_t n = 0; n < i.result.pose_residuals.size(); ++n)
              rows.row(static_cast<Eigen::Index>(n)) = to_deg(i.result.pose_residuals[n]);
            return rows;
          },
          "(N, 6), mm and deg: measured minus modelled.")
      .def_property_readonly(
          "weights", [](const Identified& i) { return i.result.weights; },
          "Of the poses; below 1 where one does not fit the others.")
      .def(
          "correct", [](const Identified& i, const RowsIn& t) { return commands_for(i.model, t, &i.result); },
          py::arg("targets"), "As Model.correct, with sigmas.");
  module.def("identify", &identify_machine, py::arg("machine"), py::arg("observations"), py::kw_only(),
             py::arg("frames_unknown") = false, py::arg("geometry") = true, py::arg("scales") = true,
             py::arg("curve_terms") = 0, py::arg("sag") = false, py::arg("fixed") = std::set<std::string>{},
             py::arg("robust") = true,
             "Identifies joints, offsets and scales by least squares of whitened leg residuals.");
  py::class_<Compensation>(module, "Compensation",
                           "All methods side by side, and the chosen one fitted to all poses.")
      .def_property_readonly("chosen", [](const Compensation& c) { return c.report.chosen; })
      .def_property_readonly("why", [](const Compensation& c) { return c.report.why; })
      .def_property_readonly("model", [](const Compensation& c) { return c.report.fitted.model; })
      .def_property_readonly(
          "methods", &methods_of,
          "Dicts of name, numbers, failure, errors (that would remain, cross-validated), targets_lost.")
      .def_property_readonly(
          "uncompensated", [](const Compensation& c) { return c.report.uncompensated; },
          "Errors before, or None without targets.")
      .def_property_readonly("outliers", [](const Compensation& c) { return c.report.outliers; })
      .def_property_readonly(
          "doubt",
          [](const Compensation& c) {
            return c.report.doubt
                       ? std::optional(c.report.doubt->cause() + "; " + c.report.doubt->instruction)
                       : std::nullopt;
          },
          "Why poses and machine contradict each other, so that no command is given; else None.")
      .def(
          "correct",
          [](const Compensation& c, const RowsIn& t) {
            return rows_of_commands(corrected_commands(c.report, targets_of(t)));
          },
          py::arg("targets"),
          "As Model.correct, with sigmas where the method knows them; no numbers where there is a doubt.");
  module.def(
      "compensate",
      [](const PlatformGeometry& machine, const ObservationSet& observations, const std::string& method,
         bool frames_unknown) {
        CalibrateOptions options;
        options.method = method;
        options.identify.frames_unknown = frames_unknown;
        return Compensation{calibrate(machine, observations, options)};
      },
      py::arg("machine"), py::arg("observations"), py::kw_only(), py::arg("method") = "auto",
      py::arg("frames_unknown") = false,
      "Fits the paper's options 1 to 3 and the kinematic models; method: auto, option1, option2, option3, "
      "kinematic, geometry.");
}

}  // namespace hexcal::python
