// What files that read and write JSON begin with.
#pragma once
#include <nlohmann/json.hpp>

#include "cmake/preludes/text.hpp"
