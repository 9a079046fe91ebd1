#include "server/store/blob_store.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "core/base/random.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::store {
namespace {
namespace fs = std::filesystem;

std::vector<std::byte> randomBytes(std::uint64_t seed, std::size_t size) {
  Random random(seed);
  std::vector<std::byte> bytes(size);
  for (auto& b : bytes) b = static_cast<std::byte>(random.bits());
  return bytes;
}

std::vector<std::byte> bytesOf(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

int filesIn(const fs::path& folder) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) count += entry.is_regular_file() ? 1 : 0;
  return count;
}

TEST(BlobStore, NamesABlobByTheSha256OfItsBytes) {
  // FIPS 180-2, appendix B.1
  EXPECT_EQ(blobIdOf(bytesOf("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(BlobStore, GivesBackWhatWasPutAndKeepsItOnce) {
  const test::TemporaryFolder folder;
  auto blobs = BlobStore::open(folder.path()).value();
  const auto bytes = randomBytes(1, 3'000'001);
  const BlobId id = blobs.put(bytes).value();
  EXPECT_EQ(blobs.put(bytes).value(), id);
  EXPECT_EQ(blobs.get(id).value(), bytes);
  EXPECT_EQ(filesIn(folder.path()), 1);
  EXPECT_TRUE(fs::exists(folder.path() / id.substr(0, 2) / id));
}

TEST(BlobStore, KeepsTheEmptyBlob) {
  const test::TemporaryFolder folder;
  auto blobs = BlobStore::open(folder.path()).value();
  EXPECT_TRUE(blobs.get(blobs.put({}, Gzip::Sibling).value()).value().empty());
}

TEST(BlobStore, RefusesNamesThatAreNotHashes) {
  const test::TemporaryFolder folder;
  const auto blobs = BlobStore::open(folder.path()).value();
  for (const std::string& name : {std::string(), std::string("../../etc/passwd"), std::string(64, 'g'),
                                  std::string(63, 'a') + "/", std::string(64, 'a')}) {
    EXPECT_EQ(blobs.get(name).error().code, ErrorCode::NotFound) << name;
  }
}

TEST(BlobStore, NoticesBytesThatChangedOnDisk) {
  const test::TemporaryFolder folder;
  auto blobs = BlobStore::open(folder.path()).value();
  const BlobId id = blobs.put(randomBytes(2, 100)).value();
  std::fstream(blobs.file(id).value(), std::ios::in | std::ios::out).put('!').put('?');
  EXPECT_EQ(blobs.get(id).error().code, ErrorCode::Corrupt);
}

TEST(BlobStore, WritesAGzippedSiblingThatUnpacksToTheSameBytes) {
  const test::TemporaryFolder folder;
  auto blobs = BlobStore::open(folder.path()).value();
  const std::vector<std::byte> bytes(1'000'000, std::byte{7});
  const BlobId id = blobs.put(bytes, Gzip::Sibling).value();
  const auto packed = readFile(blobs.gzipFile(id)).value();
  EXPECT_LT(packed.size(), 10'000u);
  std::vector<std::byte> unpacked(bytes.size() + 1);
  z_stream stream{};
  ASSERT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  stream.avail_out = static_cast<uInt>(unpacked.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  unpacked.resize(stream.total_out);
  inflateEnd(&stream);
  EXPECT_EQ(unpacked, bytes);
}

TEST(BlobStore, FailsCleanlyAtEveryStepOfAWriteAndSucceedsAfterwards) {
  const auto bytes = randomBytes(3, 2'500'000);  // three write steps
  int steps = 0;
  for (int fail_at = 0;; ++fail_at) {
    const test::TemporaryFolder folder;
    int step = 0;
    auto blobs = BlobStore::open(folder.path(), [&](std::string_view) { return step++ == fail_at; }).value();
    const auto first = blobs.put(bytes);
    if (first) {
      steps = fail_at;
      break;
    }
    EXPECT_EQ(first.error().code, ErrorCode::Io);
    // failed or not, what stands under the final name is whole
    if (const auto found = blobs.get(blobIdOf(bytes)); found) {
      EXPECT_EQ(*found, bytes);
    }
    ASSERT_EQ(blobs.get(blobs.put(bytes).value()).value(), bytes) << "after failing at step " << fail_at;
    EXPECT_EQ(filesIn(folder.path()), 1) << "a half-written file was left at step " << fail_at;
  }
  EXPECT_EQ(steps, 7);  // open, 3 writes, fsync, rename, fsync folder
}

TEST(BlobStore, KilledAtAnyStepLeavesTheBlobWholeOrAbsent) {
  const auto bytes = randomBytes(4, 2'500'000);
  for (int kill_at = 0; kill_at < 7; ++kill_at) {
    const test::TemporaryFolder folder;
    const pid_t child = ::fork();
    if (child == 0) {
      int step = 0;
      auto blobs = BlobStore::open(folder.path(), [&](std::string_view) {
        if (step++ == kill_at) ::raise(SIGKILL);
        return false;
      });
      const auto ignored = blobs->put(bytes);
      ::_exit(ignored ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    auto blobs = BlobStore::open(folder.path()).value();
    const auto found = blobs.get(blobIdOf(bytes));
    if (found) {
      EXPECT_EQ(*found, bytes);
    } else {
      EXPECT_EQ(found.error().code, ErrorCode::NotFound);
    }
    EXPECT_EQ(found.has_value(), kill_at == 6) << "the rename is what makes it appear";
  }
}

TEST(BlobStore, ManyWritersOfOneBlobAndOfOthersAgree) {
  const test::TemporaryFolder folder;
  std::vector<std::thread> writers;
  for (std::uint64_t t = 0; t < 8; ++t) {
    writers.emplace_back([&folder, t] {
      auto blobs = BlobStore::open(folder.path()).value();
      for (std::uint64_t i = 0; i < 8; ++i) {
        EXPECT_TRUE(blobs.put(randomBytes(100 + i, 50'000)).has_value());
        EXPECT_TRUE(blobs.put(randomBytes(1000 * (t + 1) + i, 50'000)).has_value());
      }
    });
  }
  for (auto& writer : writers) writer.join();
  const auto blobs = BlobStore::open(folder.path()).value();
  for (std::uint64_t i = 0; i < 8; ++i) {
    EXPECT_EQ(blobs.get(blobIdOf(randomBytes(100 + i, 50'000))).value(), randomBytes(100 + i, 50'000));
  }
  EXPECT_EQ(filesIn(folder.path()), 8 + 64);
}

TEST(BlobStore, AdoptsAFileWithoutCopyingIt) {
  const test::TemporaryFolder folder;
  auto blobs = BlobStore::open(folder.path() / "blobs").value();
  const auto bytes = randomBytes(5, 1'500'000);
  const fs::path file = folder.path() / "live";
  std::ofstream(file).write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const BlobId id = blobs.adopt(file).value();
  EXPECT_EQ(id, blobIdOf(bytes));
  EXPECT_EQ(blobs.get(id).value(), bytes);
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(blobs.adopt(file).error().code, ErrorCode::NotFound);
}

TEST(ReplaceFile, LeavesTheOldFileWhenTheNewOneCannotBePutInPlace) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "out" / "a.rec";
  EXPECT_EQ(replaceFile(file, bytesOf("x")).error().code, ErrorCode::Io);
  fs::create_directories(file);  // a folder stands where the file should go
  EXPECT_EQ(replaceFile(file, bytesOf("x")).error().code, ErrorCode::Io);
  EXPECT_EQ(filesIn(folder.path()), 0);
}

}  // namespace
}  // namespace spinaltap::store
