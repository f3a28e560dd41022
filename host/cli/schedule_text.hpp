#pragma once
// What an experiment will do and how long it takes, in words, before anything moves.

#include <nlohmann/json.hpp>
#include <string>

#include "host/config/experiment.hpp"

namespace diastole {

/// "26 min 10 s"
std::string duration_words(double duration_s);

/// One line a block of the schedule (or a segment), and the whole.
std::string plan_words(const Experiment& experiment);

/// {"cycles", "estimate_s", "slices", "waits", "blocks": [...]}
nlohmann::json plan_json(const Experiment& experiment);

}  // namespace diastole
