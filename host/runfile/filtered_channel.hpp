#pragma once
// The low-passed cavity pressure, /pressure/cavity_filtered_kPa, beside the raw one.

#include "protocol/runfile/run.hpp"

namespace diastole {

/// Adds the channel cavity_filtered_kPa: cavity_kPa low-passed at 30 Hz forward and backward (low_pass.hpp), each
/// stretch between missing samples by itself, and its notes: `filter`, `cutoff_Hz`, `order` of a pass, `passes`,
/// `rate_Hz` that it was designed for, and `delay_s`, which is 0.
/// Does nothing when samples come slower than 75 Hz, too slow for that cutoff, or when there is none.
void add_filtered_channel(runfile::PressureTrace& pressure);

}  // namespace diastole
