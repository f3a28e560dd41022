#pragma once
// The campaign at bit error rates from 1e-5 to 1e-2, with lost bytes and lost, repeated, overtaken and cut-off
// frames beside it.

#include "tests/link_faults/campaign.hpp"

namespace diastole::link_faults {

CampaignOptions at_rate(double bit_error, std::uint64_t frames, std::uint64_t seed);

/// `frames` at each rate: no command is carried out that was not sent, none twice, none out of order, and none is
/// lost once the line is good. Prints a table.
void expect_no_wrong_command(std::uint64_t frames);

}  // namespace diastole::link_faults
