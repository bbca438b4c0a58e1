#include "tools/io/calibration_record.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"
#include "tools/io/json_text.h"
#include "tools/io/kept_text.h"

namespace hexcal {
namespace {

using RecordJson = nlohmann::ordered_json;

// JSON has no infinity: null.
RecordJson number_json(double value) {
  return std::isfinite(value) ? RecordJson(value) : RecordJson(nullptr);
}

double number_of(const RecordJson& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

RecordJson vector_json(const Vector6d& v) { return std::vector<double>(v.begin(), v.end()); }

// What was not measured is no number: null too, but never where there may be infinity.
double measured_of(const RecordJson& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Vector6d vector_of(const RecordJson& json) {
  Vector6d v;
  for (Eigen::Index i = 0; i < 6; ++i) v[i] = measured_of(json.at(static_cast<std::size_t>(i)));
  return v;
}

RecordJson errors_json(const ErrorStatistics& e) {
  return {{"poses", e.poses},
          {"range", vector_json(e.range)},
          {"magnitudes", {e.position_magnitude_mm, e.orientation_magnitude_rad}},
          {"mean", vector_json(e.mean)},
          {"rms", vector_json(e.rms)},
          {"max_abs", vector_json(e.max_abs)},
          {"position_mm", {e.position_rms_mm, e.position_max_mm}},
          {"orientation_rad", {e.orientation_rms_rad, e.orientation_max_rad}}};
}

ErrorStatistics errors_of(const RecordJson& json) {
  ErrorStatistics e;
  e.poses = json.at("poses").get<int>();
  e.range = vector_of(json.at("range"));
  e.position_magnitude_mm = measured_of(json.at("magnitudes").at(0));
  e.orientation_magnitude_rad = measured_of(json.at("magnitudes").at(1));
  e.mean = vector_of(json.at("mean"));
  e.rms = vector_of(json.at("rms"));
  e.max_abs = vector_of(json.at("max_abs"));
  e.position_rms_mm = measured_of(json.at("position_mm").at(0));
  e.position_max_mm = measured_of(json.at("position_mm").at(1));
  e.orientation_rms_rad = measured_of(json.at("orientation_rad").at(0));
  e.orientation_max_rad = measured_of(json.at("orientation_rad").at(1));
  return e;
}

RecordJson method_json(const CrossValidation& method) {
  RecordJson pairs = RecordJson::array();
  for (const PosePair& pair : method.held_out)
    pairs.push_back({vector_json(pair.target.vector()), vector_json(pair.actual.vector())});
  RecordJson predicted;
  if (method.predicted) predicted = {method.predicted->position_mm, method.predicted->orientation_rad};
  return {{"name", method.name},
          {"predicted", predicted},
          {"method", name(method.method)},
          {"complexity", method.complexity},
          {"failure", method.failure},
          {"poses", method.poses},
          {"errors", errors_json(method.errors)},
          {"standard_errors", {method.position_rms_se_mm, method.orientation_rms_se_rad}},
          {"targets_lost", method.targets_lost},
          {"held_out", pairs},
          {"held_out_observations", method.held_out_index}};
}

CrossValidation method_of(const RecordJson& json) {
  CrossValidation method;
  method.name = json.at("name").get<std::string>();
  method.method = method_from_name(json.at("method").get<std::string>()).value();
  method.complexity = json.at("complexity").get<int>();
  method.failure = json.at("failure").get<std::string>();
  method.poses = json.at("poses").get<int>();
  method.errors = errors_of(json.at("errors"));
  method.position_rms_se_mm = measured_of(json.at("standard_errors").at(0));
  method.orientation_rms_se_rad = measured_of(json.at("standard_errors").at(1));
  if (const RecordJson& predicted = json.at("predicted"); !predicted.is_null())
    method.predicted = PredictedOverAll{predicted.at(0).get<double>(), predicted.at(1).get<double>()};
  method.targets_lost = json.at("targets_lost").get<int>();
  for (const RecordJson& pair : json.at("held_out")) {
    method.held_out.push_back(
        {Pose::from_vector(vector_of(pair.at(0))), Pose::from_vector(vector_of(pair.at(1)))});
  }
  method.held_out_index = json.at("held_out_observations").get<std::vector<std::size_t>>();
  return method;
}

RecordJson identified_json(const IdentifyResult& identified, const Identifiability& judged) {
  RecordJson out{{"sigma0", identified.sigma0},
                 {"sigma0_of_measurement", identified.sigma0_of_measurement},
                 {"leg_sigma_mm", identified.leg_sigma_mm},
                 {"free_parameters", judged.free_parameters},
                 {"rank", judged.rank},
                 {"determined", judged.determined},
                 {"condition", number_json(judged.condition)},
                 {"advice", judged.advice},
                 {"beyond_geometry", judged.beyond_geometry}};
  if (identified.drift) out["drift"] = {vector_json(identified.drift->motion), identified.drift->f};
  for (const char* list : {"parameters", "correlations", "weak", "legs"}) out[list] = RecordJson::array();
  for (const ParameterReport& p : judged.parameters)
    out["parameters"].push_back({p.name, p.unit, p.value, p.sigma, number_json(p.tolerance)});
  for (const CorrelatedPair& pair : judged.correlations)
    out["correlations"].push_back({pair.a, pair.b, pair.correlation});
  for (const WeakDirection& weak : judged.weak)
    out["weak"].push_back({number_json(weak.gain), weak.parameters});
  for (const LegDiagnosis& leg : judged.legs)
    out["legs"].push_back({leg.leg, leg.largest_effect_mm, leg.wrong, leg.sentence});
  return out;
}

void read_identified(const RecordJson& json, CalibrationReport& report) {
  IdentifyResult& identified = report.fitted.identified.emplace();
  identified.stroke_range.setZero();
  identified.sigma0 = json.at("sigma0").get<double>();
  identified.sigma0_of_measurement = json.at("sigma0_of_measurement").get<double>();
  identified.leg_sigma_mm = json.at("leg_sigma_mm").get<double>();
  if (json.contains("drift")) {
    identified.drift = Drift{vector_of(json.at("drift").at(0)), json.at("drift").at(1).get<double>()};
  }
  Identifiability judged;
  judged.free_parameters = json.at("free_parameters").get<int>();
  judged.rank = json.at("rank").get<int>();
  judged.determined = json.at("determined").get<int>();
  judged.condition = number_of(json.at("condition"));
  judged.advice = json.at("advice").get<std::string>();
  judged.beyond_geometry = json.at("beyond_geometry").get<std::vector<std::string>>();
  for (const RecordJson& p : json.at("parameters")) {
    judged.parameters.push_back({p.at(0).get<std::string>(), p.at(1).get<std::string>(),
                                 p.at(2).get<double>(), p.at(3).get<double>(), number_of(p.at(4))});
  }
  for (const RecordJson& pair : json.at("correlations")) {
    judged.correlations.push_back(
        {pair.at(0).get<std::string>(), pair.at(1).get<std::string>(), pair.at(2).get<double>()});
  }
  for (const RecordJson& weak : json.at("weak"))
    judged.weak.push_back({number_of(weak.at(0)), weak.at(1).get<std::vector<std::string>>()});
  for (const RecordJson& leg : json.at("legs")) {
    judged.legs.push_back(
        {leg.at(0).get<int>(), leg.at(1).get<double>(), leg.at(2).get<bool>(), leg.at(3).get<std::string>()});
  }
  report.identifiability = judged;
}

CalibrationReport report_of(const RecordJson& json) {
  CalibrationReport report;
  report.outliers = json.at("outliers").get<std::vector<std::string>>();
  report.unexplained = json.at("unexplained").get<std::vector<std::string>>();
  if (json.contains("uncompensated")) report.uncompensated = errors_of(json.at("uncompensated"));
  report.comparison.leave_one_out = json.at("leave_one_out").get<bool>();
  report.comparison.folds = json.at("folds").get<int>();
  for (const RecordJson& method : json.at("methods")) report.comparison.methods.push_back(method_of(method));
  for (const RecordJson& lost : json.at("dropped")) {
    PaperEvaluation evaluation;
    evaluation.method = lost.at(0).get<std::string>();
    evaluation.dropped = lost.at(1).get<std::vector<std::string>>();
    report.evaluations.push_back(evaluation);
  }
  report.chosen = json.at("chosen").get<std::string>();
  report.why = json.at("why").get<std::string>();
  if (json.contains("doubt")) {
    const RecordJson& doubt = json.at("doubt");
    report.doubt = MachineDoubt{doubt.at(0).get<std::string>(), doubt.at(1).get<std::string>(),
                                doubt.at(2).get<std::string>()};
  }
  if (json.contains("identified")) read_identified(json.at("identified"), report);
  return report;
}

}  // namespace

std::string calibration_key(std::string_view version, const std::filesystem::path& hexapod,
                            const ObservationFiles& files, std::string_view settings) {
  std::vector<std::filesystem::path> inputs{hexapod, files.poses};
  for (const auto* file : {&files.targets, &files.legs, &files.covariance}) {
    if (*file) inputs.push_back(**file);
  }
  return sha256_hex(fmt::format("{}{}", provenance_line(version, "compensate", inputs), settings));
}

std::string calibration_record_text(const std::string& key, const CalibrationReport& report) {
  RecordJson out{{"key", key},
                 {"chosen", report.chosen},
                 {"why", report.why},
                 {"outliers", report.outliers},
                 {"unexplained", report.unexplained},
                 {"leave_one_out", report.comparison.leave_one_out},
                 {"folds", report.comparison.folds},
                 {"methods", RecordJson::array()},
                 {"dropped", RecordJson::array()}};
  if (report.uncompensated) out["uncompensated"] = errors_json(*report.uncompensated);
  if (report.doubt) out["doubt"] = {report.doubt->evidence, report.doubt->slip, report.doubt->instruction};
  for (const CrossValidation& method : report.comparison.methods)
    out["methods"].push_back(method_json(method));
  for (const PaperEvaluation& evaluation : report.evaluations)
    out["dropped"].push_back({evaluation.method, evaluation.dropped});
  if (report.fitted.identified && report.identifiability)
    out["identified"] = identified_json(*report.fitted.identified, *report.identifiability);
  return sealed_json(json_text(out));
}

std::optional<CalibrationReport> read_calibration_record(const std::filesystem::path& path,
                                                         const std::string& key) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const std::string text = read_file(path, ReadFor::own_result);
    const auto kept = unsealed_json(text);
    if (!kept) return std::nullopt;  // an edited or damaged record is made anew
    const RecordJson json = RecordJson::parse(*kept);
    if (json.at("key").get<std::string>() != key) return std::nullopt;
    return report_of(json);
  } catch (const RecordJson::exception&) {
    return std::nullopt;  // of another program
  }
}

}  // namespace hexcal
