#include "tools/benchmarks/process_figures.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

namespace diastole {
namespace {

constexpr double MB_per_kB = 1024e-6;

double cpu_seconds(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string text;
  std::getline(file, text);
  const size_t name_end = text.rfind(')');  // the name may hold spaces
  if (name_end == std::string::npos) return 0;
  std::istringstream fields(text.substr(name_end + 1));
  std::string skipped;
  for (int field = 3; field < 14; ++field)
    fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace

ProcessFigures figures_of(pid_t process) {
  ProcessFigures figures{.cpu_s = cpu_seconds(process)};
  std::ifstream file(fmt::format("/proc/{}/status", process));
  for (std::string name; file >> name;) {
    double kB = 0;
    if (name == "VmRSS:" && file >> kB) figures.resident_MB = MB_per_kB * kB;
    if (name == "VmHWM:" && file >> kB) figures.most_resident_MB = MB_per_kB * kB;
    file.ignore(1000, '\n');
  }
  return figures;
}

double slope_per_interval(std::span<const double> values) {
  if (values.size() < 2) return 0;
  const double middle = 0.5 * static_cast<double>(values.size() - 1);
  double products = 0, squares = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - middle;
    products += x * values[i];
    squares += x * x;
  }
  return products / squares;
}

}  // namespace diastole
