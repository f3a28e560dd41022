#pragma once
// Remarks that clients can provoke at will, and that must not fill the log: a few a second are written, of the
// others their number.

#include <spdlog/spdlog.h>

#include <chrono>
#include <string>

namespace diastole {

class QuietLog {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void warn(const std::string& text, Time now = std::chrono::steady_clock::now()) {
    if (now - second_began_ >= std::chrono::seconds(1)) {
      if (left_out_ > 0) spdlog::warn("{} more remarks like the last ones were left out", left_out_);
      second_began_ = now;
      written_ = left_out_ = 0;
    }
    if (written_ < most_a_second) {
      ++written_;
      spdlog::warn("{}", text);
    } else {
      ++left_out_;
    }
  }

 private:
  static constexpr int most_a_second = 5;
  Time second_began_{};
  int written_ = 0;
  int left_out_ = 0;
};

}  // namespace diastole
