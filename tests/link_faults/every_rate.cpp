#include "tests/link_faults/every_rate.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace diastole::link_faults {
namespace {

/// Two repetition times: one may be needed to end a frame that has lost its end, the next brings the rest.
constexpr std::uint64_t kMostRecovery_ms = 150;

}  // namespace

CampaignOptions at_rate(double bit_error, std::uint64_t frames, std::uint64_t seed) {
  CampaignOptions options;
  options.rates = {.bit_error = bit_error,
                   .byte_loss = 1e-4,
                   .frame_loss = 1e-3,
                   .repetition = 1e-2,
                   .reordering = 1e-2,
                   .truncation = 1e-3,
                   .delay_us = 1'000,
                   .jitter_us = 2'000};
  options.frames = frames;
  options.seed = seed;
  return options;
}

void expect_no_wrong_command(std::uint64_t frames) {
  fmt::print("{}", table_head());
  std::uint64_t damaged = 0, total = 0;
  for (const double bit_error : {1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2}) {
    const CampaignOptions options =
        at_rate(bit_error, frames, 20 + static_cast<std::uint64_t>(1e5 * bit_error));
    const CampaignReport report = run_campaign(options);
    fmt::print("{}", table_row(options, report));
    EXPECT_EQ(report.wrong, 0U) << bit_error;
    EXPECT_EQ(report.missing, 0U) << bit_error;
    EXPECT_LE(report.worst_recovery_ms, kMostRecovery_ms) << bit_error;
    EXPECT_GE(report.line.frames, frames);
    EXPECT_GT(report.line.damaged, 0U);
    EXPECT_GT(report.line.repeated, 0U);
    EXPECT_GT(report.line.reordered, 0U);
    EXPECT_GT(report.commands, 0U);
    EXPECT_GT(report.telemetry, 0U);
    damaged += report.line.damaged;
    total += report.line.frames;
  }
  fmt::print("{} frames, {} damaged; a CRC-32 lets one damaged frame in 2^32 pass: {:.1e} expected here\n",
             total, damaged, std::ldexp(static_cast<double>(damaged), -32));
}

}  // namespace diastole::link_faults
