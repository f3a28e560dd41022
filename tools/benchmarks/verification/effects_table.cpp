// Prints docs/effects.md: build/release/bin/effects_table > docs/effects.md

#include <iostream>

#include "tools/benchmarks/verification/effects_page.hpp"

int main() { std::cout << diastole::effects_page(); }
