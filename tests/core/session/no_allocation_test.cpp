// Counts every allocation of this program, to see that none happens inside step().
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <utility>

#include "core/session/scenes.h"

namespace {
std::atomic<std::uint64_t> allocations{0};
}  // namespace

void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace spinaltap::session {
namespace {

TEST(Session, DoesNotAllocateInsideAStep) {
  for (const std::string_view engine : drill::engineNames()) {
    const std::uint64_t before_create = allocations.load();
    auto session = Session::create(*sceneVolume(30), {reportBit(), std::string(engine)});
    ASSERT_TRUE(session.has_value());
    EXPECT_GT(allocations.load(), before_create);  // the counter counts
    const std::uint64_t before = allocations.load();
    for (std::uint64_t cycle = 0; cycle < 500; ++cycle) (void)session->step(sceneInput(Scene::Hand, cycle, 1.0));
    Input sweep = sceneInput(Scene::On, 501, -5);
    sweep.axis = {0, 1, 0};
    for (int i = 0; i < 20; ++i) {  // the whole volume at once, and refusals
      sweep.tip_mm = {0, 20, 0.2 * i};
      (void)session->step(sweep);
      Input refused = sweep;
      refused.axis = {0, 0, 0};
      (void)session->step(refused);
    }
    EXPECT_EQ(allocations.load(), before) << engine;
  }
}

}  // namespace
}  // namespace spinaltap::session
