#pragma once
// What a person should know about a simulated run: registers that are not modelled, clocks out of range.
// Each remark is kept once, with the time of its first occurrence and a count.

#include <cstdint>
#include <map>
#include <string>

namespace diastole::board_model {

struct Note {
  uint64_t first_ns = 0;
  uint64_t count = 0;
};

class Notes {
 public:
  void add(const std::string& text, uint64_t time_ns) {
    auto [place, fresh] = notes_.try_emplace(text, Note{time_ns, 0});
    ++place->second.count;
  }
  [[nodiscard]] const std::map<std::string, Note>& all() const { return notes_; }

 private:
  std::map<std::string, Note> notes_;
};

}  // namespace diastole::board_model
