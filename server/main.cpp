#include "server/cli/run.h"

int main(int argc, char** argv) { return spinaltap::cli::run(argc, argv); }
