#pragma once
// Runs a command and catches what it says.

#include <array>
#include <cstdio>
#include <string>

namespace diastole {

struct Output {
  int status = 0;
  std::string text;  ///< of both standard streams
};

inline Output output_of(const std::string& command) {
  Output output;
  FILE* pipe = ::popen(("{ " + command + "; } 2>&1").c_str(), "r");
  std::array<char, 4096> block{};
  for (size_t count = 0; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;)
    output.text.append(block.data(), count);
  output.status = ::pclose(pipe);
  return output;
}

}  // namespace diastole
