#pragma once
// The remarks of a run for those who look on. Each has a number that it keeps. When there are more than `most`, the
// oldest go; errors and prompts go last, when they alone are more than `most`.

#include <fmt/chrono.h>

#include <algorithm>
#include <ctime>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "host/acquisition/acquisition.hpp"

namespace diastole {

/// The wall clock, for people: "2026-11-21T09:04:00Z".
inline std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

class RemarkLog {
 public:
  explicit RemarkLog(size_t most = 2000) : most_(most) {}

  void add(const RunRemark& remark, const std::string& utc) {
    const size_t number = next_++;
    kept_[number] = {number, utc, remark};
    const bool lasts = remark.level == "error" || remark.code == "prompt";
    (lasts ? lasting_ : passing_).push_back(number);
    if (kept_.size() <= most_) return;
    std::deque<size_t>& from = passing_.empty() ? lasting_ : passing_;
    kept_.erase(from.front());
    from.pop_front();
  }

  struct Entry {
    size_t number = 0;
    std::string utc;
    RunRemark remark;
  };
  struct Page {
    std::vector<Entry> remarks;  ///< by number
    size_t next = 0;             ///< the first number that is not among them
  };
  /// Those from number `first` on that are still here, `at_most` of them.
  [[nodiscard]] Page from(size_t first, size_t at_most) const {
    Page page{{}, std::max(first, next_)};
    auto each = kept_.lower_bound(first);
    for (; each != kept_.end() && page.remarks.size() < at_most; ++each)
      page.remarks.push_back(each->second);
    if (each != kept_.end()) page.next = each->first;
    return page;
  }

 private:
  size_t most_;
  size_t next_ = 0;
  std::map<size_t, Entry> kept_;
  std::deque<size_t> lasting_, passing_;  // their numbers
};

}  // namespace diastole
