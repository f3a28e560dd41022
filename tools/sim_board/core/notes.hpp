#pragma once
// What a person should know about a simulated run: registers that are not modelled, clocks out of range.
// Each remark is kept once, with the time of its first occurrence and a count.

#include <cstdint>
#include <map>
#include <string>

#include "tools/sim_board/core/clock.hpp"

namespace diastole::board_model {

struct Note {
  uint64_t first_ns = 0;
  uint64_t count = 0;
};

class Notes {
 public:
  explicit Notes(const Clock& clock) : clock_(clock) {}

  void add(const std::string& text) {
    auto [place, fresh] = notes_.try_emplace(text, Note{clock_.ns(clock_.now()), 0});
    ++place->second.count;
  }
  [[nodiscard]] const std::map<std::string, Note>& all() const { return notes_; }

 private:
  const Clock& clock_;
  std::map<std::string, Note> notes_;
};

}  // namespace diastole::board_model
