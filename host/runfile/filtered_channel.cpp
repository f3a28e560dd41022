#include "host/runfile/filtered_channel.hpp"

namespace diastole {

std::optional<signal::LowPassDesign> filter_of(double spacing_s) {
  if (spacing_s <= 0) return std::nullopt;
  const signal::LowPassDesign design{.rate_Hz = 1 / spacing_s,
                                     .passes = signal::Passes::forward_and_backward};
  if (design.rate_Hz < signal::least_rate_over_cutoff * design.cutoff_Hz) return std::nullopt;
  return design;
}

std::map<std::string, runfile::Attribute, std::less<>> notes_of(const signal::LowPassDesign& design) {
  return {{"filter", std::string("Butterworth low-pass, forward and backward")},
          {"cutoff_Hz", design.cutoff_Hz},
          {"order", int64_t{design.order}},
          {"passes", int64_t{2}},
          {"rate_Hz", design.rate_Hz},
          {"delay_s", 0.0}};
}

}  // namespace diastole
