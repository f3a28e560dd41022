#pragma once
// The two errors that reach a person. A program throws them while it starts up and reads its input; the
// front door prints them and exits with 2 (InputError) or 3 (HardwareError). Nothing half-written remains.

#include <stdexcept>
#include <string>

namespace diastole {

/// Where in the input something is wrong, what it is, and what the reader can do about it.
/// Printed as:  FILE: PLACE: PROBLEM\n  REMEDY
struct InputFault {
  std::string file;  ///< path as the user gave it; empty when the fault is on the command line
  std::string
      place;  ///< "line 7, key segment[0].stroke_mL", "dataset /pressure/time_s, index 812"; may be empty
  std::string problem;  ///< what is wrong, with the offending value
  std::string remedy;   ///< what to change
};

class InputError : public std::runtime_error {
 public:
  explicit InputError(InputFault fault);
  [[nodiscard]] const InputFault& fault() const noexcept { return fault_; }

 private:
  InputFault fault_;
};

/// A device, port or link that does not answer as it must: which one, what happened, what to try.
/// Printed as:  DEVICE: PROBLEM\n  REMEDY
class HardwareError : public std::runtime_error {
 public:
  HardwareError(std::string device, std::string problem, std::string remedy);
};

}  // namespace diastole
