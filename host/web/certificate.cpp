#include "host/web/certificate.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <memory>

#include "protocol/contract/input_error.hpp"

namespace diastole::web {
namespace {

namespace fs = std::filesystem;

template <auto Free>
struct Freed {
  void operator()(auto* object) const { (void)Free(object); }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using X509Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;
using File = std::unique_ptr<std::FILE, Freed<std::fclose>>;

constexpr long valid_s = 10L * 365 * 24 * 3600;

[[noreturn]] void fail(const fs::path& file, const std::string& problem) {
  throw HardwareError(
      file.string(), problem,
      "Make its directory (journal_dir) writable, or remove the file so that another is made.");
}

bool add_extension(X509* certificate, int kind, const std::string& value) {
  const Extension extension(X509V3_EXT_conf_nid(nullptr, nullptr, kind, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

X509Certificate self_signed(EVP_PKEY* key, const std::string& machine) {
  X509Certificate made(X509_new());
  X509* certificate = made.get();
  std::array<unsigned char, 16> serial{};
  if (certificate == nullptr || RAND_bytes(serial.data(), serial.size()) != 1) return nullptr;
  serial[0] = static_cast<unsigned char>((serial[0] & 0x7FU) | 0x40U);  // positive, and of full length
  ASN1_STRING_set(X509_get_serialNumber(certificate), serial.data(), serial.size());
  X509_set_version(certificate, X509_VERSION_3);
  X509_gmtime_adj(X509_getm_notBefore(certificate), -24L * 3600);  // clocks differ
  X509_gmtime_adj(X509_getm_notAfter(certificate), valid_s);
  X509_NAME* name = X509_get_subject_name(certificate);
  const std::string common = machine.substr(0, 64);  // the longest that X.520 allows
  const auto* bytes = reinterpret_cast<const unsigned char*>(common.data());
  const bool whole =
      X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8, bytes, static_cast<int>(common.size()), -1, 0) ==
          1 &&
      X509_set_issuer_name(certificate, name) == 1 && X509_set_pubkey(certificate, key) == 1 &&
      add_extension(certificate, NID_basic_constraints, "critical,CA:FALSE") &&
      add_extension(certificate, NID_ext_key_usage, "serverAuth") &&
      add_extension(certificate, NID_subject_alt_name, "DNS:" + machine + ",DNS:localhost,IP:127.0.0.1") &&
      X509_sign(certificate, key, EVP_sha256()) > 0;
  return whole ? std::move(made) : nullptr;
}

/// Whole or not at all, and never readable by others.
void make(const fs::path& file, const std::string& machine) {
  const Key key(EVP_EC_gen("P-256"));
  const X509Certificate certificate = key ? self_signed(key.get(), machine) : nullptr;
  if (!certificate)
    fail(file, fmt::format("cannot be made: OpenSSL makes no certificate for \"{}\"", machine));
  const fs::path part = file.string() + ".part";
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  const File stream(descriptor < 0 ? nullptr : ::fdopen(descriptor, "w"));
  const bool written =
      stream && PEM_write_X509(stream.get(), certificate.get()) == 1 &&
      PEM_write_PrivateKey(stream.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1 &&
      std::fflush(stream.get()) == 0 && ::fsync(::fileno(stream.get())) == 0;
  std::error_code error;
  if (written) fs::rename(part, file, error);
  if (!written || error) fail(file, "cannot be written");
}

}  // namespace

std::string certificate_fingerprint(const fs::path& file, const std::string& machine) {
  if (!fs::exists(file)) make(file, machine.empty() ? "diastole" : machine);
  const File stream(std::fopen(file.c_str(), "re"));
  const X509Certificate certificate(stream ? PEM_read_X509(stream.get(), nullptr, nullptr, nullptr)
                                           : nullptr);
  if (!certificate) fail(file, "holds no certificate that can be read");
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int bytes = 0;
  if (X509_digest(certificate.get(), EVP_sha256(), digest.data(), &bytes) != 1) fail(file, "has no digest");
  std::string fingerprint;
  for (unsigned int i = 0; i < bytes; ++i)
    fingerprint += fmt::format("{}{:02X}", i == 0 ? "" : ":", digest[i]);
  return fingerprint;
}

}  // namespace diastole::web
