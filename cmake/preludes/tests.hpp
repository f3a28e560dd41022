// What tests begin with: GoogleTest costs more than most tests' own code.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cmake/preludes/text.hpp"
