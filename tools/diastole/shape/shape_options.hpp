#pragma once
// Options that `shape` and `run --shape` share.

#include <CLI/CLI.hpp>

#include "tools/diastole/shape/shaper.hpp"

namespace diastole::shaping {

/// --study, --period-s and what else a request needs beside the target. `request` must live until the command has run.
void add_request_to(CLI::App& command, ShapeRequest& request);

}  // namespace diastole::shaping
