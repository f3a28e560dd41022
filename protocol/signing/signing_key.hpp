#pragma once
// The file that holds the key which firmware is signed with: PKCS #8 in PEM (RFC 8410), as `openssl genpkey -algorithm
// ed25519` makes it. Whoever has it can make firmware that the controller takes.

#include <optional>
#include <string>

#include "protocol/signing/ed25519.hpp"

namespace diastole::signing {

/// Makes a key of the system's random numbers and writes it to a file that only its owner may read. Throws
/// std::runtime_error with what to do: the file exists, or cannot be written.
SecretKey make_key_file(const std::string& file);

/// Throws std::runtime_error: missing, readable by others, or no such key.
SecretKey read_key_file(const std::string& file);

std::string to_pem(const SecretKey& secret);
/// Nothing if the text is no Ed25519 key without a passphrase.
std::optional<SecretKey> from_pem(const std::string& text);

}  // namespace diastole::signing
