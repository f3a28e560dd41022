#pragma once
// The certificate by which a browser knows the console beyond this machine: self-signed, as no authority vouches for a rig's PC. Who
// opens the page for the first time compares its fingerprint with the one that the daemon printed.

#include <filesystem>
#include <string>

namespace diastole::web {

/// SHA-256 of the certificate in `file` (PEM, the private key with it), as browsers show it: "3F:A0:...". Without that file one is
/// made for `machine` (ECDSA P-256, ten years), readable by its owner only. Throws HardwareError if it can be neither read nor made.
std::string certificate_fingerprint(const std::filesystem::path& file, const std::string& machine);

}  // namespace diastole::web
