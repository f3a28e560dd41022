#include "protocol/signing/signing_key.hpp"

#include <gmock/gmock.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

namespace diastole::signing {
namespace {

using ::testing::HasSubstr;

/// A folder of its own, gone at the end.
class SigningKey : public ::testing::Test {
 protected:
  SigningKey() { std::filesystem::create_directories(folder_); }
  ~SigningKey() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / ("diastole-signing-key-" + std::to_string(::getpid()));
  const std::string file_ = folder_ / "key.pem";

  static std::string refusal(const std::string& file) {
    try {
      (void)read_key_file(file);
      return "";
    } catch (const std::runtime_error& problem) {
      return problem.what();
    }
  }
};

TEST_F(SigningKey, IsForItsOwnerOnlyAndNeverOverwritten) {
  const SecretKey made = make_key_file(file_);
  struct stat facts {};
  ASSERT_EQ(::stat(file_.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777U, 0600U);
  EXPECT_EQ(read_key_file(file_), made);
  EXPECT_THROW((void)make_key_file(file_), std::runtime_error);
  EXPECT_EQ(read_key_file(file_), made);
  EXPECT_NE(make_key_file(file_ + "2"), made);
  EXPECT_THROW((void)make_key_file("/no such folder/key.pem"), std::runtime_error);
}

TEST_F(SigningKey, IsReadByOpenSsl) {
  const SecretKey made = make_key_file(file_);
  const std::unique_ptr<BIO, decltype(&BIO_free)> bio(BIO_new_file(file_.c_str(), "r"), BIO_free);
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(
      PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, nullptr), EVP_PKEY_free);
  ASSERT_NE(key, nullptr);
  PublicKey open{};
  std::size_t size = open.size();
  ASSERT_EQ(EVP_PKEY_get_raw_public_key(key.get(), open.data(), &size), 1);
  EXPECT_EQ(open, public_key_of(made));
}

TEST_F(SigningKey, IsRefusedWithTheReason) {
  EXPECT_THAT(refusal(file_), HasSubstr("diastole flash --new-key"));
  (void)make_key_file(file_);
  std::filesystem::permissions(file_, std::filesystem::perms::group_read, std::filesystem::perm_options::add);
  EXPECT_THAT(refusal(file_), HasSubstr("chmod 600"));
  const std::string whole = to_pem(SecretKey{1, 2, 3});
  EXPECT_EQ(from_pem(whole), (SecretKey{1, 2, 3}));
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = '*';
    ASSERT_FALSE(from_pem(changed)) << at;
    ASSERT_FALSE(from_pem(whole.substr(0, at))) << at;
  }
}

}  // namespace
}  // namespace diastole::signing
