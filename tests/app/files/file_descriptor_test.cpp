#include "files/file_descriptor.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <thread>

namespace {

bool is_open(int number) {
    return fcntl(number, F_GETFD) >= 0;
}

TEST(FileDescriptor, ClosesWhatItOwnsOnce) {
    int number = -1;
    {
        app::FileDescriptor first(open("/dev/null", O_RDONLY));
        ASSERT_TRUE(first);
        number = first.get();
        app::FileDescriptor second(std::move(first));
        EXPECT_EQ(second.get(), number);
        app::FileDescriptor third;
        EXPECT_FALSE(third);
        third = std::move(second);
        EXPECT_TRUE(is_open(number));
    }
    EXPECT_FALSE(is_open(number));
    EXPECT_TRUE(app::FileDescriptor().close());
}

TEST(FileDescriptor, APipeEndsWithItsWriterAndIsNotInherited) {
    app::Pipe pipe = app::make_pipe();
    EXPECT_EQ(fcntl(pipe.in.get(), F_GETFD) & FD_CLOEXEC, FD_CLOEXEC);
    EXPECT_EQ(write(pipe.in.get(), "x", 1), 1);
    pipe.in.close();
    char byte = 0;
    EXPECT_EQ(read(pipe.out.get(), &byte, 1), 1);
    EXPECT_EQ(read(pipe.out.get(), &byte, 1), 0);
}

/// A pipe holds 64 KiB.
TEST(FileDescriptor, WritesAllIntoAPipeThatDoesNotWait) {
    app::Pipe pipe = app::make_pipe();
    ASSERT_EQ(fcntl(pipe.in.get(), F_SETFL, O_NONBLOCK), 0);
    const std::string text(300'000, 'x');
    std::string got;
    std::thread reader([&] {
        char block[4096];
        for (ssize_t size = 0; (size = read(pipe.out.get(), block, sizeof block)) > 0;)
            got.append(block, static_cast<std::size_t>(size));
    });
    EXPECT_TRUE(pipe.in.write(text)) << strerror(errno);
    pipe.in.close();
    reader.join();
    EXPECT_EQ(got, text);
}

TEST(Cannot, SaysWhatTheSystemRefusedAndWhy) {
    errno = ENOENT;
    EXPECT_EQ(app::cannot("open x"), "cannot open x: No such file or directory");
    EXPECT_EQ(app::cannot("open UDP port 9", EADDRINUSE), "cannot open UDP port 9: Address already in use");
}

}  // namespace
