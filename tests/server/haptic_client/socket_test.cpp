#include "server/haptic_client/socket.h"

#include <gtest/gtest.h>

namespace spinaltap::haptic_client {
namespace {

TEST(ServerAddress, IsReadWithAndWithoutSchemePortAndSlash) {
  for (const auto& [url, host, port] : {std::tuple{"http://127.0.0.1:8080", "127.0.0.1", 8080},
                                        {"http://localhost:8080/", "localhost", 8080},
                                        {"127.0.0.1:9", "127.0.0.1", 9},
                                        {"http://drill-1.ward_3.example", "drill-1.ward_3.example", 80},
                                        {"http://[::1]:8080", "::1", 8080},
                                        {"[fe80::1]", "fe80::1", 80}}) {
    const auto address = parseAddress(url);
    ASSERT_TRUE(address.has_value()) << url;
    EXPECT_EQ(address->host, host) << url;
    EXPECT_EQ(address->port, port) << url;
  }
  EXPECT_EQ((Address{"::1", 80}.text()), "[::1]:80");
  EXPECT_EQ((Address{"host", 8080}.text()), "host:8080");
}

TEST(ServerAddress, IsRefusedInOneLineThatSaysWhy) {
  for (const std::string url :
       {"", "http://", "https://host:1", "ws://host:1", "http://:80", "http://host:", "http://host:0",
        "http://host:65536", "http://host:8o80", "http://host:80/x", "http://a b:80", "http://host\r\nX: y:80",
        "http://user@host:80", "http://[::1:80", "http://[::1]80", "http://host:80:80"}) {
    const auto address = parseAddress(url);
    ASSERT_FALSE(address.has_value()) << url;
    EXPECT_EQ(address.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(address.error().message.find("no server's address"), std::string::npos);
  }
}

TEST(ServerAddress, ThatNobodyListensAtIsSaidSo) {
  const auto socket = connectTo({"127.0.0.1", 1}, std::chrono::seconds(5));
  ASSERT_FALSE(socket.has_value());
  EXPECT_EQ(socket.error().message, "no server at 127.0.0.1:1: Connection refused");
}

}  // namespace
}  // namespace spinaltap::haptic_client
