// What files of the host begin with, which read TOML.
#pragma once
#include <toml++/toml.h>

#include "cmake/preludes/text.hpp"
