// Client and daemon of a socket know each other by the user ids that the kernel vouches for.

#include "host/rpc/peer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "host/rpc/client.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr uid_t stranger = 65'534;  // nobody

/// Another user's program that listens at a socket and takes connections, without a word, until it is destroyed.
class ListeningStranger {
 public:
  explicit ListeningStranger(const std::filesystem::path& socket) {
    int ready[2] = {-1, -1};
    EXPECT_EQ(::pipe(ready), 0);
    child_ = ::fork();
    if (child_ == 0) {
      sockaddr_un address{};
      address.sun_family = AF_UNIX;
      socket.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
      const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
      const bool done = ::setgid(stranger) == 0 && ::setuid(stranger) == 0 &&
                        ::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0 &&
                        ::chmod(socket.c_str(), 0777) == 0 && ::listen(listener, 4) == 0;
      (void)!::write(ready[1], done ? "1" : "0", 1);
      for (;;)
        ::pause();
    }
    char answer = '0';
    EXPECT_EQ(::read(ready[0], &answer, 1), 1);
    listens = answer == '1';
    ::close(ready[0]);
    ::close(ready[1]);
  }
  ~ListeningStranger() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  ListeningStranger(const ListeningStranger&) = delete;
  ListeningStranger& operator=(const ListeningStranger&) = delete;

  bool listens = false;

 private:
  pid_t child_ = -1;
};

void make_folder(const std::filesystem::path& folder, mode_t mode, uid_t owner) {
  std::filesystem::create_directories(folder);
  ASSERT_EQ(::chmod(folder.c_str(), mode), 0);
  ASSERT_EQ(::chown(folder.c_str(), owner, owner), 0);
}

#define NEEDS_ROOT() \
  if (::geteuid() != 0) GTEST_SKIP() << "another user's program can be started by root only"

TEST(Daemon, OfAnotherUserIsNotTakenForOnesOwnWhereOthersCanPutASocket) {
  NEEDS_ROOT();
  const Scratch scratch("squatter");
  make_folder(scratch.path(), 01777, 0);  // as /tmp is
  const std::filesystem::path socket = scratch / "diastole.sock";
  const ListeningStranger squatter(socket);
  ASSERT_TRUE(squatter.listens);
  EXPECT_THAT(message_of<HardwareError>([&] { (void)DaemonClient(socket); }),
              AllOf(HasSubstr("need not be the rig's daemon"), HasSubstr("nobody"), HasSubstr("--socket")));
}

TEST(Daemon, OfAnotherUserIsKnownByItsPlace) {
  NEEDS_ROOT();
  // Scratch folders lie in /tmp, where no stranger's place is good; /run is root's.
  const std::filesystem::path place = "/run/diastole-test-" + std::to_string(::getpid());
  make_folder(place, 0755, stranger);
  const std::filesystem::path socket = place / "daemon.sock";
  {
    const ListeningStranger service(socket);
    ASSERT_TRUE(service.listens);
    EXPECT_NO_THROW((void)DaemonClient(socket));
    EXPECT_TRUE(may_serve(stranger, socket));
    EXPECT_FALSE(may_serve(stranger - 1, socket)) << "the place is another's";
    std::filesystem::create_symlink(socket, "/tmp/diastole-test-link-" + std::to_string(::getpid()));
    EXPECT_FALSE(may_serve(stranger, "/tmp/diastole-test-link-" + std::to_string(::getpid())))
        << "a link that anybody could have laid";
    std::filesystem::remove("/tmp/diastole-test-link-" + std::to_string(::getpid()));
    ASSERT_EQ(::chmod(place.c_str(), 0775), 0);
    EXPECT_FALSE(may_serve(stranger, socket)) << "its group may write there";
  }
  std::filesystem::remove_all(place);
}

TEST(Daemon, OfRootOrOfTheUsersOwnIsTakenAnywhere) {
  EXPECT_TRUE(may_serve(0, "/tmp/any.sock"));
  EXPECT_TRUE(may_serve(::geteuid(), "/tmp/any.sock"));
  EXPECT_FALSE(may_serve(::geteuid() + 1, "/nowhere/at/all.sock"));
}

TEST(Daemon, DoesNotListenWhereEverybodyMayWrite) {
  const Scratch scratch("open-place");
  ASSERT_EQ(::chmod(scratch.path().c_str(), 01777), 0);
  EXPECT_THAT(message_of<HardwareError>([&] { expect_own_place(scratch / "diastole.sock"); }),
              AllOf(HasSubstr("every user may write in"), HasSubstr("[daemon]")));
  ASSERT_EQ(::chmod(scratch.path().c_str(), 0755), 0);
  EXPECT_NO_THROW(expect_own_place(scratch / "diastole.sock"));
}

}  // namespace
}  // namespace diastole
