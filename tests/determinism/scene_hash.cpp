// One line per scene run: "on bounded 378 500 <state hash> <points removed>". No test library, so that any compiler at
// any level can build it in seconds.
//
// "bits all 0 0" gives the hash of tests/scenes/bits.h.
//
//   scene_hash SCENE ENGINE DISCS CYCLES [SCENE ENGINE DISCS CYCLES ...]
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "core/session/scenes.h"
#include "tests/scenes/bits.h"

int main(int argc, char** argv) {
  using namespace spinaltap;
  if (argc < 5 || (argc - 1) % 4 != 0) {
    std::fprintf(stderr, "usage: scene_hash SCENE ENGINE DISCS CYCLES ...\n");
    return 2;
  }
  for (int i = 1; i < argc; i += 4) {
    if (std::strcmp(argv[i], "bits") == 0) {
      std::printf("%s %s %s %s %016llx 0\n", argv[i], argv[i + 1], argv[i + 2], argv[i + 3],
                  static_cast<unsigned long long>(hashOfBits()));
      continue;
    }
    const auto scene = session::sceneNamed(argv[i]);
    const auto result =
        scene ? session::runScene(*scene, argv[i + 1], std::strtoull(argv[i + 3], nullptr, 10), std::atoi(argv[i + 2]))
              : tl::unexpected(scene.error());
    if (!result) {
      std::fprintf(stderr, "scene_hash: %s\n", result.error().message.c_str());
      return 1;
    }
    std::printf("%s %s %s %s %016llx %llu\n", argv[i], argv[i + 1], argv[i + 2], argv[i + 3],
                static_cast<unsigned long long>(result->state_hash), static_cast<unsigned long long>(result->removed));
    std::fflush(stdout);
  }
  return 0;
}
