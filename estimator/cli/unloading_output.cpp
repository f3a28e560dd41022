#include "estimator/cli/unloading_output.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace diastole {

nlohmann::ordered_json unloading_json(const UnloadedModel& unloaded) {
  const auto volume_mL = [](const ElasticModel& model) -> nlohmann::ordered_json {
    if (!model.system().cavity_closed()) return nullptr;
    return model.cavity_volume_mL(model.rest_state());
  };
  const UnloadReport& report = unloaded.shape.report;
  nlohmann::ordered_json json = {{"reason", std::string(describe(report.reason))},
                                 {"reached_pressure_kPa", report.reached_pressure_kPa},
                                 {"load_steps", report.load_steps},
                                 {"iterations", report.iterations},
                                 {"cavity_imaged_mL", volume_mL(unloaded.imaged)},
                                 {"cavity_unloaded_mL", nullptr},
                                 {"return_mm", nullptr},
                                 {"returned", unloaded.returned()}};
  if (!report.converged()) return json;
  json["cavity_unloaded_mL"] = volume_mL(unloaded.model);
  json["return_mm"] = unloaded.back.farthest_mm;
  return json;
}

void print_unloading(const nlohmann::ordered_json& json, double imaged_at_kPa) {
  fmt::print("Without the {:g} kPa of the image", imaged_at_kPa);
  if (!json["cavity_unloaded_mL"].is_null()) {
    fmt::print(" the cavity holds {:.3f} mL instead of {:.3f}, and", json["cavity_unloaded_mL"].get<double>(),
               json["cavity_imaged_mL"].get<double>());
  }
  fmt::print(" the body comes back to its image within {:.2g} mm.\n", json["return_mm"].get<double>());
}

std::string unloading_sentence(const FittedUnloading& unloaded) {
  std::string words = fmt::format("The shape was imaged at {:.4f} \u00b1 {:.4f} kPa", unloaded.estimated_kPa,
                                  unloaded.se_kPa);
  if (std::isfinite(unloaded.cavity_unloaded_mL)) {
    words += fmt::format("; without load the cavity holds {:.3f} mL instead of {:.3f}",
                         unloaded.cavity_unloaded_mL, unloaded.cavity_imaged_mL);
  }
  if (unloaded.returned) {
    words += fmt::format("; {:.4f} kPa bring the image back to {:.2g} mm", unloaded.estimated_kPa,
                         unloaded.return_mm);
  }
  return words + ".";
}

}  // namespace diastole
