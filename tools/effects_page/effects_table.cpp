// Prints docs/effects.md: build/release/bin/effects_table > docs/effects.md

#include <iostream>

#include "tools/effects_page/effects_page.hpp"

int main() { std::cout << diastole::effects_page(); }
