#pragma once
// The low-passed cavity pressure, /pressure/cavity_filtered_kPa, beside the raw one: cavity_kPa at 30 Hz forward and
// backward (zero_phase.hpp), each stretch between missing samples by itself.

#include <map>
#include <optional>
#include <string>

#include "protocol/runfile/run.hpp"
#include "protocol/signal/low_pass.hpp"

namespace diastole {

/// None when samples come slower than 75 Hz, too slow for that cutoff, or when there are fewer than two (spacing 0).
std::optional<signal::LowPassDesign> filter_of(double spacing_s);

/// What the dataset tells of it: `filter`, `cutoff_Hz`, `order` of a pass, `passes`, `rate_Hz` that it was designed for,
/// and `delay_s`, which is 0.
std::map<std::string, runfile::Attribute, std::less<>> notes_of(const signal::LowPassDesign& design);

}  // namespace diastole
