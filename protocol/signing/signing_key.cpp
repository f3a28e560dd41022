#include "protocol/signing/signing_key.hpp"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>

namespace diastole::signing {
namespace {

constexpr std::string_view head = "-----BEGIN PRIVATE KEY-----\n", tail = "\n-----END PRIVATE KEY-----\n";
constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
/// RFC 8410: version 0, algorithm 1.3.101.112, an octet string of 32 bytes in an octet string.
constexpr std::array<std::uint8_t, 16> der_head{0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06,
                                                0x03, 0x2b, 0x65, 0x70, 0x04, 0x22, 0x04, 0x20};
using Der = std::array<std::uint8_t, der_head.size() + sizeof(SecretKey)>;  // 48: no padding in base 64

std::string base64(const Der& bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned group = unsigned{bytes[i]} << 16 | unsigned{bytes[i + 1]} << 8 | bytes[i + 2];
    for (const unsigned shift : {18U, 12U, 6U, 0U})
      text += alphabet[group >> shift & 63];
  }
  return text;
}

std::optional<Der> from_base64(std::string_view text) {
  Der bytes{};
  if (text.size() != bytes.size() / 3 * 4) return {};
  for (std::size_t i = 0, out = 0; i < text.size(); i += 4) {
    unsigned group = 0;
    for (const char letter : text.substr(i, 4)) {
      const std::size_t digit = alphabet.find(letter);
      if (digit == std::string_view::npos) return {};
      group = group << 6 | static_cast<unsigned>(digit);
    }
    for (const unsigned shift : {16U, 8U, 0U})
      bytes[out++] = static_cast<std::uint8_t>(group >> shift);
  }
  return bytes;
}

}  // namespace

std::string to_pem(const SecretKey& secret) {
  Der der{};
  std::copy(secret.begin(), secret.end(), std::copy(der_head.begin(), der_head.end(), der.begin()));
  return std::string(head) + base64(der) + std::string(tail);
}

std::optional<SecretKey> from_pem(const std::string& text) {
  const std::string_view whole(text);
  if (!whole.starts_with(head) || !whole.ends_with(tail) || whole.size() < head.size() + tail.size())
    return {};
  const auto der = from_base64(whole.substr(head.size(), whole.size() - head.size() - tail.size()));
  if (!der || !std::equal(der_head.begin(), der_head.end(), der->begin())) return {};
  SecretKey secret{};
  std::copy(der->begin() + der_head.size(), der->end(), secret.begin());
  return secret;
}

SecretKey make_key_file(const std::string& file) {
  SecretKey secret{};
  if (::getrandom(secret.data(), secret.size(), 0) != static_cast<ssize_t>(secret.size()))
    throw std::runtime_error("the system has no random numbers");
  const std::string pem = to_pem(secret);
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0) {
    throw std::runtime_error(file + (errno == EEXIST
                                         ? ": exists, and a key is never overwritten: name another file"
                                         : ": cannot be written: name a file in a folder of yours"));
  }
  const bool written = ::write(descriptor, pem.data(), pem.size()) == static_cast<ssize_t>(pem.size()) &&
                       ::fsync(descriptor) == 0;
  ::close(descriptor);
  if (written) return secret;
  ::unlink(file.c_str());
  throw std::runtime_error(file + ": cannot be written: is the disk full?");
}

SecretKey read_key_file(const std::string& file) {
  struct stat facts {};
  std::ifstream stream(file, std::ios::binary);
  if (!stream || ::stat(file.c_str(), &facts) != 0 || !S_ISREG(facts.st_mode))
    throw std::runtime_error(file + ": cannot be read: diastole flash --new-key FILE makes a key");
  if ((facts.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw std::runtime_error(file + ": is open to others than its owner: chmod 600 " + file);
  std::string text(200, '\0');  // a key has 119
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (const auto secret = from_pem(text)) return *secret;
  throw std::runtime_error(file +
                           ": is no Ed25519 key in PEM without passphrase: diastole flash --new-key FILE "
                           "makes one");
}

}  // namespace diastole::signing
