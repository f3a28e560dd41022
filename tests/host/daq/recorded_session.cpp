#include "tests/host/daq/recorded_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace diastole::daq {

RecordedSession read_session(const std::filesystem::path& path) {
  RecordedSession session;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "daq") session.daq += line.substr(4) + "\n";
    if (kind == "channel") session.channels += "[[daq.channel]]\n" + line.substr(8) + "\n";
    if (kind == ">" || kind == "<") {
      RecordedSession::Step step{kind == ">", {}};
      for (unsigned byte = 0; words >> std::hex >> byte;)
        step.bytes.push_back(static_cast<uint8_t>(byte));
      session.steps.push_back(std::move(step));
    }
    if (kind == "=") {
      std::vector<double>& reading = session.readings.emplace_back();
      for (double value = 0; words >> value;)
        reading.push_back(value);
    }
  }
  return session;
}

std::string play(const RecordedSession& session, const std::function<std::vector<uint8_t>()>& receive,
                 const std::function<void(std::span<const uint8_t>)>& send,
                 const std::function<bool()>& stopped) {
  std::vector<uint8_t> inbox;
  for (size_t i = 0; i < session.steps.size(); ++i) {
    const RecordedSession::Step& step = session.steps[i];
    if (!step.asked) {
      send(step.bytes);
      continue;
    }
    while (inbox.size() < step.bytes.size()) {
      if (stopped()) return fmt::format("step {} was not asked", i);
      const std::vector<uint8_t> got = receive();
      inbox.insert(inbox.end(), got.begin(), got.end());
    }
    const auto end = inbox.begin() + static_cast<std::ptrdiff_t>(step.bytes.size());
    if (!std::equal(inbox.begin(), end, step.bytes.begin()))
      return fmt::format("step {} was asked otherwise", i);
    inbox.erase(inbox.begin(), end);
  }
  return {};
}

}  // namespace diastole::daq
