// server/cli/run.h - the whole program.
#pragma once

namespace spinaltap::cli {

/// Exit codes: 0 done, 1 failed, 2 wrong usage.
[[nodiscard]] int run(int argc, char** argv);

}  // namespace spinaltap::cli
