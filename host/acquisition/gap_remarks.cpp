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
    told_ = gaps_ == 0 && now_ns >= quiet_until_ns_;
    if (told_) {
      tell_("gap", "samples are missing: " + reason);
    } else if (gaps_++ == 0) {
      since_ns_ = now_ns;
    }
  }
  count_ += count;
  if (told_) return;
  samples_ += count;
  reasons_[reason] += count;
}

void GapRemarks::received(uint64_t now_ns) {
  if (!std::exchange(open_, false)) return;
  if (!std::exchange(told_, false)) return;
  quiet_until_ns_ = now_ns + interval_ns;
  tell_("gap_end", fmt::format("the gap cost {}", counted(count_, more_, "sample")));
}

void GapRemarks::look(uint64_t now_ns) {
  if (gaps_ > 0 && now_ns >= quiet_until_ns_) tell_many(now_ns);
}

void GapRemarks::close(uint64_t now_ns) {
  received(now_ns);
  if (gaps_ > 0) tell_many(now_ns);
}

void GapRemarks::tell_many(uint64_t now_ns) {
  const auto most = std::ranges::max_element(reasons_, {}, [](const auto& each) { return each.second; });
  const bool still = open_ && !told_;
  tell_("gaps", fmt::format("{}, {} missing in {:.1f} s{}: {}{}", counted(gaps_, "", "gap"),
                            counted(samples_, "", "sample"), 1e-9 * static_cast<double>(now_ns - since_ns_),
                            still ? ", and more" : "", most->first,
                            reasons_.size() > 1 ? ", and other reasons" : ""));
  quiet_until_ns_ = now_ns + interval_ns;
  gaps_ = samples_ = 0;
  reasons_.clear();
  if (!still) return;
  told_ = true;  // from here on it is a gap by itself
  count_ = 0;
  more_ = "more ";
}

}  // namespace diastole
