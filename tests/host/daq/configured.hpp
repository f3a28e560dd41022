#pragma once
// An instrument as a rig file's [daq] table configures it.

#include <functional>
#include <memory>
#include <string>

#include "host/daq/driver.hpp"

namespace diastole::daq {

/// Timeout for a loaded machine.
inline const OpenOptions patient{.address = {}, .least_timeout_ms = 60};

using OpenPolled = std::function<std::unique_ptr<PolledInstrument>(const OpenOptions&)>;

/// `daq` and `channels` are TOML.
inline OpenInstrument configured_any(Configure configure, const std::string& daq,
                                     const std::string& channels) {
  TableReader root = TableReader::from_text("[daq]\n" + daq + channels, "rig.toml");
  TableReader table = root.table("daq");
  std::vector<TableReader> blocks = table.tables("channel");
  OpenInstrument open = configure(table, blocks);
  for (TableReader& block : blocks)
    block.finish();
  table.finish();
  return open;
}

inline OpenPolled configured(Configure configure, const std::string& daq, const std::string& channels) {
  return [open = configured_any(configure, daq, channels)](const OpenOptions& options) {
    return std::unique_ptr<PolledInstrument>(dynamic_cast<PolledInstrument*>(open(options).release()));
  };
}

}  // namespace diastole::daq
