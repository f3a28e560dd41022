#pragma once
// Sessions one after the other, each planned from those before: what `run --shape` and `simulate --shape` do. The front door
// brings it to the commands that acquire, since planning takes the estimator too.

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "host/rpc/run_session.hpp"
#include "protocol/contract/command.hpp"

namespace diastole {

class SessionSeries {
 public:
  virtual ~SessionSeries() = default;

  /// Its options, on a command that acquires. They must have been given for asked() to be true.
  virtual void add_options(CLI::App& command) = 0;
  [[nodiscard]] virtual bool asked() const = 0;

  /// Acquires an experiment file into a run file.
  using Acquire = std::function<SessionResult(const std::string& experiment, const std::string& run)>;
  /// Brings the rig: asked for once, when there is something to run.
  using Connect = std::function<Acquire()>;
  /// Run files get their number before the ending of `output`. Throws InputError before the rig is asked for and anything is written.
  virtual ExitCode carry_out(const std::string& output, bool force, const Connect& connect,
                             const CommandOutput& out) = 0;
};

}  // namespace diastole
