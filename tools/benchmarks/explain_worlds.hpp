#pragma once
// `tools/bench explain --worlds`: explanations in three worlds that share no code with each other, with and without the
// rig's references (docs/explain.md#three-worlds). The recordings of 1 and 2 are no part of the tree.
//
//   1  recordings of an independent program whose physics the rig's model holds exactly
//   2  recordings of a second one: three rigs, each with imperfections of its own
//   3  the project's own simulated rig, `diastole simulate --rig-seed R --hide ID --hide-seed S`: rounds of 40 sessions,
//      each with another rig, its two references, every effect once, three of no library, pairs, and nothing hidden.
//      What an open answer or one with hints proposes is run on that rig if wanted, with the instruments that it
//      asks for but an image at rest, and asked again with both runs

#include <cstdint>
#include <filesystem>
#include <vector>

namespace diastole::bench {

struct WorldsOptions {
  std::vector<int> worlds{1, 2, 3};
  uint64_t rounds = 5;
  uint64_t first_round = 1;
  bool proposals = false;      ///< of world 3: runs them
  bool resume = false;         ///< takes sessions and answers that a stopped run left
  std::filesystem::path data;  ///< holds rig/ (world 1) and rig2/ (world 2)
  std::filesystem::path kept;  ///< simulated sessions and explanations
};

/// Prints a table a world and one of all; whether all targets are met. A world whose data are absent is skipped
/// visibly.
bool explain_worlds(const WorldsOptions& options);

}  // namespace diastole::bench
