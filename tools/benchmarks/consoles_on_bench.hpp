#pragma once
// Web consoles at a daemon: each asks what the page asks (host/web/page/console.js) and as often as it, in a thread of
// its own.

#include <string>
#include <thread>
#include <vector>

namespace diastole {

class ConsolesOnBench {
 public:
  /// `url`: with a token, as the daemon reports it. Throws HardwareError when one is not let in.
  ConsolesOnBench(const std::string& url, int count);

 private:
  std::vector<std::jthread> threads_;
};

}  // namespace diastole
