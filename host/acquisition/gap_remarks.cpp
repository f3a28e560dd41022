#include "host/acquisition/gap_remarks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace diastole {
namespace {

std::string counted(uint64_t count, const char* more, const char* what) {
  return fmt::format("{} {}{}{}", count, more, what, count == 1 ? "" : "s");
}

}  // namespace

void GapRemarks::missing(uint64_t now_ns, uint64_t count, const std::string& reason) {
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

void GapRemarks::received(uint64_t now_ns) {
  if (!std::exchange(open_, false)) return;
  if (!std::exchange(reported_, false)) return;
  quiet_until_ns_ = now_ns + interval_ns;
  report_("gap_end", fmt::format("the gap cost {}", counted(count_, more_, "sample")));
}

void GapRemarks::update(uint64_t now_ns) {
  if (gaps_ > 0 && now_ns >= quiet_until_ns_) report_many(now_ns);
}

void GapRemarks::close(uint64_t now_ns) {
  received(now_ns);
  if (gaps_ > 0) report_many(now_ns);
}

void GapRemarks::report_many(uint64_t now_ns) {
  const auto most = std::ranges::max_element(reasons_, {}, [](const auto& each) { return each.second; });
  const bool still = open_ && !reported_;
  report_("gaps", fmt::format("{}, {} missing in {:.1f} s{}: {}{}", counted(gaps_, "", "gap"),
                              counted(samples_, "", "sample"), 1e-9 * static_cast<double>(now_ns - since_ns_),
                              still ? ", and more" : "", most->first,
                              reasons_.size() > 1 ? ", and other reasons" : ""));
  quiet_until_ns_ = now_ns + interval_ns;
  gaps_ = samples_ = 0;
  reasons_.clear();
  if (!still) return;
  reported_ = true;  // from here on it is a gap by itself
  count_ = 0;
  more_ = "more ";
}

}  // namespace diastole
