#include "host/controller/version_match.hpp"

#include <fmt/format.h>

namespace diastole {
namespace {

std::string in_words(const ProgramVersion& version) {
  return fmt::format("{}.{}.{}", version[0], version[1], version[2]);
}

}  // namespace

const ProgramVersion own_version{DIASTOLE_VERSION_MAJOR, DIASTOLE_VERSION_MINOR, DIASTOLE_VERSION_PATCH};

std::optional<VersionMismatch> compare_versions(const wire::Hello& firmware, const ProgramVersion& program,
                                                uint32_t program_schema, const std::string& port) {
  if (firmware.schema_hash == program_schema) return std::nullopt;
  const ProgramVersion found{firmware.version_major, firmware.version_minor, firmware.version_patch};
  VersionMismatch mismatch;
  mismatch.problem = fmt::format("its firmware {} speaks protocol {:08x}, this program {} speaks {:08x}",
                                 in_words(found), firmware.schema_hash, in_words(program), program_schema);
  if (found > program) {
    mismatch.remedy = fmt::format(
        "This program is the older one: install Diastole {0} on this computer "
        "(apt install ./diastole_{0}_amd64.deb), then start the daemon again.",
        in_words(found));
  } else {
    mismatch.remedy = fmt::format(
        "The firmware is {}: stop the daemon and flash the one that came with this program: diastole flash "
        "/usr/share/diastole/firmware/diastole-stm32f405.image --port {}",
        found < program ? "the older one" : "another build of this version", port);
  }
  return mismatch;
}

}  // namespace diastole
