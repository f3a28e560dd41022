#pragma once
// What --hide puts into the rig: effects of `diastole explain` by their ids, or of no library, with sizes drawn from a
// seed. The physics is the plant's own (plant/flaws.hpp). What was drawn goes into a sealed file and nowhere else:
//
//   {"format": "diastole-sealed", "format_version": 1, "seed": 7, "kind": "single",
//    "truth": [{"id": "air-bubble-pump", "port": "drive", "parameters": {"volume_mL": 4.2}}]}

#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::sim_rig {

/// Draws sizes and keeps what it drew.
class Draw {
 public:
  Draw(PlantConfig& rig, uint64_t seed) : plant(rig), flaws(rig.flaws), random_(seed) {}

  /// Evenly on a logarithmic scale. Precondition: 0 < low < high.
  double within(const std::string& name, double low, double high);
  /// The same with either sign.
  double either_sign(const std::string& name, double low, double high);
  int whole(const std::string& name, int low, int high);

  PlantConfig& plant;
  Flaws& flaws;  ///< the plant's
  std::map<std::string, double> drawn;

 private:
  double even();
  std::mt19937_64 random_;
};

struct HiddenKind {
  std::string_view id;
  std::string_view port;  ///< "drive", "specimen", "sensor", "clock"
  void (*put)(Draw&);

  [[nodiscard]] bool is_outside() const { return id.starts_with("outside:"); }
};

std::span<const HiddenKind> hidden_kinds();

/// Puts the named effects into the rig and returns the sealed file's text. Besides ids: "none"; "outside", one of no
/// library; "any": nothing, one effect, two, or one of no library. Throws InputError that names the nearest known id.
std::string hide(const std::vector<std::string>& ids, uint64_t seed, PlantConfig& plant);

/// One line each, for `sim_rig hidden`.
std::string list_of_hidden();

}  // namespace diastole::sim_rig
