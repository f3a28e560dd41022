#pragma once
// What is reported of gaps to the person in front: of one by itself at once that it began and what it cost; of many in a row
// one line a second, so that they drown nothing else. The journal's gap records know nothing of this.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

namespace diastole {

class GapRemarks {
 public:
  static constexpr uint64_t interval_ns = 1'000'000'000;

  using Report = std::function<void(const std::string& code, const std::string& text)>;
  explicit GapRemarks(Report report) : report_(std::move(report)) {}

  /// `count` more samples in a row are missing; times never decrease.
  void missing(uint64_t now_ns, uint64_t count, const std::string& reason) {
    if (!open_) {
      open_ = true;
      count_ = 0;
      more_ = "";
      reported_ = gaps_ == 0 && now_ns >= quiet_until_ns_;
      if (reported_) {
        report_("gap", "samples are missing: " + reason);
      } else if (gaps_++ == 0) {
        since_ns_ = now_ns;
      }
    }
    count_ += count;
    if (reported_) return;
    samples_ += count;
    reasons_[reason] += count;
  }
  /// A sample has come, or none will come any more.
  void received(uint64_t now_ns) {
    if (!std::exchange(open_, false)) return;
    if (!std::exchange(reported_, false)) return;
    quiet_until_ns_ = now_ns + interval_ns;
    report_("gap_end", fmt::format("the gap cost {}", counted(count_, more_, "sample")));
  }
  /// Reports what is due; to be called now and then.
  void update(uint64_t now_ns) {
    if (gaps_ > 0 && now_ns >= quiet_until_ns_) report_many(now_ns);
  }
  /// Reports what is left.
  void close(uint64_t now_ns) {
    received(now_ns);
    if (gaps_ > 0) report_many(now_ns);
  }

 private:
  static std::string counted(uint64_t count, const char* more, const char* what) {
    return fmt::format("{} {}{}{}", count, more, what, count == 1 ? "" : "s");
  }

  void report_many(uint64_t now_ns) {
    const auto most = std::ranges::max_element(reasons_, {}, [](const auto& each) { return each.second; });
    const bool still = open_ && !reported_;
    report_("gaps", fmt::format("{}, {} missing in {:.1f} s{}: {}{}", counted(gaps_, "", "gap"),
                                counted(samples_, "", "sample"),
                                1e-9 * static_cast<double>(now_ns - since_ns_), still ? ", and more" : "",
                                most->first, reasons_.size() > 1 ? ", and other reasons" : ""));
    quiet_until_ns_ = now_ns + interval_ns;
    gaps_ = samples_ = 0;
    reasons_.clear();
    if (!still) return;
    reported_ = true;  // from here on it is a gap by itself
    count_ = 0;
    more_ = "more ";
  }

  Report report_;
  bool open_ = false;      // samples are missing
  bool reported_ = false;  // the gap that is open: its end is reported by itself
  const char* more_ = "";  // what of it was reported already
  uint64_t count_ = 0;     // in the gap that is open
  uint64_t since_ns_ = 0;  // of the many that are not reported yet
  uint64_t quiet_until_ns_ = 0;
  uint64_t gaps_ = 0;                        // not reported yet
  uint64_t samples_ = 0;                     // in them
  std::map<std::string, uint64_t> reasons_;  // samples for each
};

}  // namespace diastole
