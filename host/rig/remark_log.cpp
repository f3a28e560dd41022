#include "host/rig/remark_log.hpp"

#include <algorithm>

namespace diastole {

void RemarkLog::add(const RunRemark& remark, const std::string& utc) {
  const size_t number = next_++;
  kept_[number] = {number, utc, remark};
  const bool lasts = remark.level == "error" || remark.code == "prompt";
  (lasts ? lasting_ : passing_).push_back(number);
  if (kept_.size() <= most_) return;
  std::deque<size_t>& from = passing_.empty() ? lasting_ : passing_;
  kept_.erase(from.front());
  from.pop_front();
}

RemarkLog::Page RemarkLog::from(size_t first, size_t at_most) const {
  Page page{{}, std::max(first, next_)};
  auto each = kept_.lower_bound(first);
  for (; each != kept_.end() && page.remarks.size() < at_most; ++each)
    page.remarks.push_back(each->second);
  if (each != kept_.end()) page.next = each->first;
  return page;
}

}  // namespace diastole
