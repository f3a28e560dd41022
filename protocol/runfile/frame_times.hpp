#pragma once
// When the scanner really took its frames: windows counted from the trigger, for frame_bins.hpp.
//
// TR times the frame's number is not when a frame was taken as soon as a sequence waits for the next trigger; the
// images state it (DICOM TriggerTime (0018,1060), in ms from the R-wave to the beginning of the frame's data). A frame
// file lists it:
//
//   frame,trigger_time_ms,width_ms
//   0,10.0,52.5
//   1,70.5,52.5
//
// `frame` and `width_ms` may be left out, further columns are ignored, and the columns may stand in any order. A
// frame without a width lasts until the next begins, the last as long as the one before it; never beyond the cycle.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace diastole::runfile {

/// A frame's time after the trigger.
struct FrameWindow {
  double from_s = 0;
  double to_s = 0;
};

struct FrameStart {
  double from_s = 0;
  std::optional<double> width_s = {};
};

/// `frames` windows of equal length that fill one period.
std::vector<FrameWindow> equal_windows(size_t frames, double period_s);

/// Frame k begins at first_s + k x repetition_s.
std::vector<FrameStart> repeated_starts(size_t frames, double first_s, double repetition_s);

/// Throws InputError with file, line and column: no column trigger_time_ms, no number, a width that is not positive,
/// starts that do not increase, frames that do not count 0, 1, 2, ...
std::vector<FrameStart> read_frame_times(const std::filesystem::path& file);
std::vector<FrameStart> parse_frame_times(const std::string& text, const std::string& file);

/// Gives those without a width one, `width_s` if it is given, else as stated above, within `interval_s`.
std::vector<FrameWindow> windows_of(const std::vector<FrameStart>& starts, std::optional<double> width_s,
                                    double interval_s);

}  // namespace diastole::runfile
