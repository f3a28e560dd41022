#include "host/rpc/control_lease.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include "host/rpc/json_rpc.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const Peer anna{1000, 41, {1000}, "anna"};
const Peer ben{1001, 42, {1001}, "ben"};

TEST(ControlLease, TheFirstGetsItAndTheSecondIsToldWhoHoldsIt) {
  ControlLease lease;
  lease.claim(1, anna);
  lease.claim(1, anna);
  try {
    lease.claim(2, ben);
    FAIL() << "granted twice";
  } catch (const rpc::Error& error) {
    EXPECT_EQ(error.code, rpc::Code::control_held);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("anna"), HasSubstr("41"), HasSubstr("--take-over anna")));
    EXPECT_EQ(error.data["uid"], 1000);
    EXPECT_EQ(error.data["pid"], 41);
  }
  EXPECT_EQ(lease.holder()->connection, 1U);
}

TEST(ControlLease, OnlyTheHolderGivesItBack) {
  ControlLease lease;
  lease.claim(1, anna);
  lease.release(2);
  EXPECT_TRUE(lease.holder());
  lease.release(1);
  EXPECT_FALSE(lease.holder());
  lease.claim(2, ben);
  EXPECT_EQ(lease.holder()->peer.user, "ben");
}

TEST(ControlLease, ATakeoverNamesTheHolder) {
  ControlLease lease;
  lease.claim(1, anna);
  EXPECT_THROW(lease.take_over(2, ben, "carla"), rpc::Error);
  EXPECT_THROW(lease.take_over(2, ben, ""), rpc::Error);
  EXPECT_EQ(lease.holder()->connection, 1U) << "a takeover that names another changes nothing";
  const auto before = lease.take_over(2, ben, "anna");
  ASSERT_TRUE(before);
  EXPECT_EQ(before->user, "anna");
  EXPECT_EQ(lease.holder()->connection, 2U);
  EXPECT_THROW(lease.claim(1, anna), rpc::Error);
  ASSERT_TRUE(lease.take_over(1, anna, "42")) << "a process number is a name too";
}

TEST(ControlLease, AFreeLeaseIsGrantedWithoutATakeover) {
  ControlLease lease;
  EXPECT_FALSE(lease.take_over(2, ben, "anna"));
  EXPECT_FALSE(lease.take_over(2, ben, "anna")) << "from oneself is none";
  EXPECT_EQ(lease.holder()->connection, 2U);
}

TEST(ControlPolicy, RootTheOwnUserAndTheGroupControlAndNobodyElse) {
  const ControlPolicy without("", "rig.toml");
  EXPECT_TRUE(without.may_control({0, 1, {}, "root"}));
  EXPECT_TRUE(without.may_control({::geteuid(), 1, {}, "me"}));
  const Peer stranger{54321, 1, {54321}, "stranger"};
  EXPECT_FALSE(without.may_control(stranger));
  EXPECT_FALSE(without.may_control(Peer{}));
  const ControlPolicy with("daemon", "rig.toml");  // every Debian has this group, number 1
  EXPECT_FALSE(with.may_control(stranger));
  EXPECT_TRUE(with.may_control({54321, 1, {54321, 1}, "member"}));
}

TEST(ControlPolicy, AGroupThatDoesNotExistIsAFaultOfTheRigFile) {
  EXPECT_THAT(message_of<InputError>([] { ControlPolicy("no-such-group", "rig.toml"); }),
              AllOf(HasSubstr("rig.toml"), HasSubstr("control_group"), HasSubstr("no-such-group")));
}

}  // namespace
}  // namespace diastole
