#pragma once
// The cine player of tracked slices by its parts, for a page that does more with it than to look.

#include <span>
#include <string>
#include <string_view>

#include "estimator/io/tracking_file.hpp"

namespace diastole::report {

/// The players' elements. `cinePlayers(record)` of the script brings them to life and returns {players}; each has an `overlays` list of
/// functions that draw on its canvas.
std::string cine_players(const TrackingRecord& record);

struct PageAsset {
  std::string_view path;  ///< "/cine.js"
  std::string_view type;
  std::string_view text;
};

/// "/page.css" of all reports, "/cine.css" and "/cine.js".
std::span<const PageAsset> cine_assets();

}  // namespace diastole::report
