// Decoders and sources of live samples, within this process.
#include "sensors/live_sources.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <lo/lo.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <zmq.hpp>

#include "files/bad_input.h"
#include "free_port.h"
#include "process/clock.h"
#include "tracking/mutation.h"

namespace {

using app::LiveSource;
using app::OscSource;
using app::RowDecoder;
using app::SourceSample;
using app::SourceStatus;
using Eigen::Vector3d;

struct Decoded {
    std::vector<std::pair<std::string, tracking::PoseSample>> rows;
    std::vector<std::string> refused;
    RowDecoder decoder{"test",
                       [this](const tracking::TraceRow& row) { rows.emplace_back(row.name, row.sample); },
                       [this](const std::string& what) { refused.push_back(what); }};
};

/// All that the source has, until it ends, or `count` samples have come, or 10 s are over.
std::vector<SourceSample> take(app::SampleSource& source, std::size_t count = SIZE_MAX) {
    std::vector<SourceSample> samples;
    const std::int64_t until = app::monotonic_ns() + 10'000'000'000;
    while (samples.size() < count && app::monotonic_ns() < until) {
        SourceSample sample;
        const SourceStatus status = source.next(sample, app::monotonic_ns() + app::kSourcePatienceNs);
        if (status == SourceStatus::ended) break;
        if (status == SourceStatus::sample) samples.push_back(sample);
    }
    return samples;
}

TEST(RowDecoder, RowsWithoutAHeadAreInMetresAndYUp) {
    Decoded d;
    d.decoder.message("1.5,left,0.1,0.2,0.3,1,0,0,0\n1.5,right,1,2,3");
    ASSERT_EQ(d.rows.size(), 2u);
    EXPECT_EQ(d.rows[0].first, "left");
    EXPECT_EQ(d.rows[0].second.t_s, 1.5);
    EXPECT_EQ(d.rows[0].second.position, Vector3d(0.1, 0.2, 0.3));
    EXPECT_TRUE(d.rows[0].second.has_orientation);
    EXPECT_EQ(d.rows[1].second.position, Vector3d(1, 2, 3));
    EXPECT_FALSE(d.rows[1].second.has_orientation);
    EXPECT_EQ(d.decoder.head(), "");
}

TEST(RowDecoder, HeadsHoldUntilTheNextHoweverTheStreamIsCut) {
    const std::string stream =
        "# units: mm\n# up: z\n# tip_m: 0,0,-0.35\nt,stick,px,py,pz\n0,a,1000,2000,3000\n\r\n"
        "t,stick,px,py,pz\r\n1,a,1,2,3\r\n";
    for (std::size_t cut = 1; cut < stream.size(); ++cut) {
        Decoded d;
        d.decoder.piece(std::string_view(stream).substr(0, cut));
        d.decoder.piece(std::string_view(stream).substr(cut));
        d.decoder.end();
        ASSERT_EQ(d.rows.size(), 2u) << cut;
        EXPECT_EQ(d.rows[0].second.position, Vector3d(1, 3, -2));
        EXPECT_EQ(d.rows[1].second.position, Vector3d(1, 2, 3));
        EXPECT_TRUE(d.refused.empty());
        EXPECT_EQ(d.decoder.head(), "t,stick,px,py,pz\n");
    }
}

TEST(RowDecoder, HeadIsNoneUntilItIsComplete) {
    Decoded d;
    d.decoder.piece("# units: mm\n# up: z\n");
    EXPECT_EQ(d.decoder.head(), "");
    d.decoder.piece("t,stick,px,py,pz\n");
    EXPECT_EQ(d.decoder.head(), "# units: mm\n# up: z\nt,stick,px,py,pz\n");
    d.decoder.piece("# units: m\n");  // of the next head
    EXPECT_EQ(d.decoder.head(), "");
}

TEST(RowDecoder, FaultyLinesAreSaidAndLeftOut) {
    Decoded d;
    d.decoder.message("1,left,0,nan,0\n2,left,0,1,0\n3,left\n" + std::string(5000, 'x') + "\n4,left,0,1,0\n");
    ASSERT_EQ(d.refused.size(), 3u);
    EXPECT_TRUE(d.refused[0].starts_with("test:1:10: error: found ")) << d.refused[0];
    EXPECT_NE(d.refused[1].find("test:3:7: error: found 2 fields, expected 9 fields: t,stick,px"),
              std::string::npos)
        << d.refused[1];
    EXPECT_EQ(d.refused[2], "test: error: found a line of more than 4096 bytes, expected a row");
    ASSERT_EQ(d.rows.size(), 2u);
    EXPECT_EQ(d.rows[1].second.t_s, 4);
}

TEST(RowDecoder, LateRowsPassForTheFiltersToJudge) {
    Decoded d;
    d.decoder.message("2,left,0,1,0\n1,left,0,1,0\n1732203547.25,left,0,1,0\n");
    EXPECT_EQ(d.rows.size(), 3u);
    EXPECT_TRUE(d.refused.empty());
}

void expect_sound(const tracking::PoseSample& sample) {
    EXPECT_TRUE(std::isfinite(sample.t_s));
    EXPECT_TRUE(sample.position.allFinite());
    EXPECT_LE(sample.position.cwiseAbs().maxCoeff(), 1000 * (1 + 1e-12));
    EXPECT_NEAR(sample.orientation.norm(), 1, 1e-12);
}

TEST(RowDecoder, MutatedMessagesGiveSoundSamplesOrOneLine) {
    const std::string good =
        "# units: mm\n# up: z\n# tip_m: 0,0,-0.35\nt,stick,px,py,pz,qw,qx,qy,qz\n0,left,10,20,30,1,0,0,0\n"
        "0.01,right,1,2,3,0.6,0.8,0,0\n0.02,left,1,2,3,,,,\n";
    std::mt19937 random(21);
    std::size_t rows = 0, refused = 0;
    Decoded d;  // one for all: what a message leaves behind matters, too
    for (int i = 0; i < 20000 && !HasFailure(); ++i) {
        d.decoder.message(tracking::mutated(good, random));
        for (const auto& [name, sample] : d.rows) expect_sound(sample);
        for (const std::string& what : d.refused)
            EXPECT_EQ(what.find_first_of(std::string("\n\r\0", 3)), std::string::npos) << what;
        rows += d.rows.size();
        refused += d.refused.size();
        d.rows.clear();
        d.refused.clear();
        EXPECT_LE(d.decoder.head().size(), 2100u);
    }
    EXPECT_GT(rows, 1000u);
    EXPECT_GT(refused, 1000u);
}

/// A source into which the test puts the samples.
struct Intake : LiveSource {
    using LiveSource::LiveSource;
    void receive(std::int64_t) override {}
};

TEST(LiveSource, IsBoundedAndCounts) {
    Intake intake(std::vector<std::string>{"left"});
    tracking::PoseSample sample;
    for (std::size_t i = 0; i < LiveSource::kLongest + 10; ++i) intake.put("left", sample, true);
    intake.put("middle", sample, true);
    EXPECT_EQ(intake.faults().lost, 10u);
    EXPECT_EQ(intake.faults().foreign, 1u);
    Intake open(std::vector<std::string>{});
    for (int i = 0; i < 20; ++i) open.put("stick" + std::to_string(i), sample, true);
    EXPECT_EQ(open.sticks().names().size(), 16u);
    EXPECT_EQ(open.faults().foreign, 4u);
}

TEST(LiveSource, TimesFromLongAgoKeepTheirNanoseconds) {
    Intake intake(std::vector<std::string>{});
    tracking::PoseSample sample;
    sample.t_s = 1732203547.25;
    intake.put("left", sample, true);
    sample.t_s = 1732203548.5;
    intake.put("left", sample, true);
    const std::vector<SourceSample> samples = take(intake, 2);
    EXPECT_EQ(samples.at(0).sample.t_s, 0.25);
    EXPECT_EQ(samples.at(1).sample.t_s, 1.5);
    EXPECT_EQ(intake.head().base_s, 1732203547.0);
}

TEST(StreamSource, ReadsToTheEndAndIsTakenUpInTheMiddle) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const std::string text = "# units: mm\n# rate_hz: 60\nt,stick,px,py,pz\n0,left,1000,0,0\n1,left,2000,0,0";
    ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(ends[1]);
    const auto source = app::make_stream_source(ends[0], {});
    const std::vector<SourceSample> samples = take(*source);
    close(ends[0]);
    ASSERT_EQ(samples.size(), 2u);
    EXPECT_EQ(samples[1].sample.position, Vector3d(2, 0, 0));
    EXPECT_EQ(source->head().keys.rate_hz, 60);
    EXPECT_FALSE(source->head().oriented);
    EXPECT_EQ(source->stream_head(), "# units: mm\n# rate_hz: 60\nt,stick,px,py,pz\n");

    ASSERT_EQ(pipe(ends), 0);
    const std::string rest = "5,left,5000,0,0\n3,left,3000,0,0\n";  // the first line began before
    ASSERT_EQ(write(ends[1], rest.data(), rest.size()), static_cast<ssize_t>(rest.size()));
    close(ends[1]);
    app::SourceOptions resumed;
    resumed.resume = true;
    resumed.stream_head = source->stream_head();
    const auto second = app::make_stream_source(ends[0], resumed);
    const std::vector<SourceSample> more = take(*second);
    close(ends[0]);
    ASSERT_EQ(more.size(), 1u);
    EXPECT_EQ(more[0].sample.position, Vector3d(3, 0, 0));
}

TEST(ZmqSource, TakesTheLastPartOfEachMessage) {
    zmq::context_t context;
    zmq::socket_t publisher(context, zmq::socket_type::pub);
    publisher.set(zmq::sockopt::linger, 0);
    publisher.bind("tcp://127.0.0.1:*");
    const auto source = app::make_zmq_source(publisher.get(zmq::sockopt::last_endpoint), {});
    std::vector<SourceSample> samples;
    // Until the subscription has reached the publisher its messages are lost.
    for (int i = 0; i < 1000 && samples.size() < 3; ++i) {
        publisher.send(zmq::str_buffer("topic"), zmq::send_flags::sndmore);
        publisher.send(zmq::str_buffer("1,left,0.5,1,0,1,0,0,0\n1,right,0,1,0\nrubbish\n"));
        SourceSample sample;
        while (source->next(sample, app::monotonic_ns() + 10'000'000) == SourceStatus::sample)
            samples.push_back(sample);
    }
    ASSERT_GE(samples.size(), 2u);
    EXPECT_EQ(source->sticks().names(), (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(samples[0].sample.position, Vector3d(0.5, 1, 0));
    EXPECT_GE(source->faults().malformed, 1u);
    EXPECT_THROW((void)app::make_zmq_source("http://x", {}), app::BadInput);
    EXPECT_THROW((void)app::make_zmq_source("tcp://", {}), app::BadInput);
}

TEST(ZmqSource, IsTakenUpWithTheHeadThatWasSentOnce) {
    zmq::context_t context;
    zmq::socket_t publisher(context, zmq::socket_type::xpub);  // says when it is subscribed to
    publisher.set(zmq::sockopt::linger, 0);
    publisher.set(zmq::sockopt::rcvtimeo, 10'000);
    publisher.bind("tcp://127.0.0.1:*");
    const std::string endpoint = publisher.get(zmq::sockopt::last_endpoint);
    zmq::message_t subscription;
    const std::string head = "# units: mm\nt,stick,px,py,pz\n";
    app::SourceOptions resumed;
    resumed.resume = true;
    {
        const auto first = app::make_zmq_source(endpoint, {});
        ASSERT_TRUE(publisher.recv(subscription));
        EXPECT_EQ(first->stream_head(), "");
        publisher.send(zmq::buffer(head + "1,left,1000,0,0\n"));
        ASSERT_EQ(take(*first, 1).size(), 1u);
        EXPECT_EQ(first->stream_head(), head);
        resumed.stream_head = first->stream_head();
    }
    ASSERT_TRUE(publisher.recv(subscription));  // that it is gone
    const auto second = app::make_zmq_source(endpoint, resumed);
    ASSERT_TRUE(publisher.recv(subscription));
    publisher.send(zmq::str_buffer("2,left,2000,0,0\n"));
    const std::vector<SourceSample> samples = take(*second, 1);
    ASSERT_EQ(samples.size(), 1u);
    EXPECT_EQ(samples[0].sample.position, Vector3d(2, 0, 0));
    EXPECT_EQ(second->stream_head(), head);
    EXPECT_EQ(second->faults().malformed, 0u);
}

// OSC.

std::vector<char> bytes_of(const std::string& path, lo_message message) {
    std::size_t size = 0;
    void* bytes = lo_message_serialise(message, path.c_str(), nullptr, &size);
    std::vector<char> result(static_cast<char*>(bytes), static_cast<char*>(bytes) + size);
    std::free(bytes);
    lo_message_free(message);
    return result;
}

lo_message floats(const std::vector<float>& values) {
    lo_message message = lo_message_new();
    for (const float value : values) lo_message_add_float(message, value);
    return message;
}

class OscSourceTest : public ::testing::Test {
protected:
    OscSource source{std::to_string(app::free_udp_port()), {}};
    SourceSample sample;

    SourceStatus next() { return source.next(sample, 0); }
};

TEST_F(OscSourceTest, TakesPositionsAndPoses) {
    source.datagram(bytes_of("/musicworld/stick/left", floats({1, 2, 3})));
    source.datagram(bytes_of("/right", floats({1, 2, 3, 0, 1, 0, 0})));
    ASSERT_EQ(next(), SourceStatus::sample);
    EXPECT_EQ(sample.sample.position, Vector3d(1, 2, 3));
    EXPECT_FALSE(sample.has_time);
    EXPECT_FALSE(sample.sample.has_orientation);
    ASSERT_EQ(next(), SourceStatus::sample);
    EXPECT_EQ(sample.stick, 1u);
    EXPECT_EQ(sample.sample.orientation.x(), 1);  // half a turn about x: order w x y z
    EXPECT_EQ(source.sticks().names(), (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(source.faults().malformed, 0u);
}

TEST_F(OscSourceTest, TimeIsAnArgumentOrTheBundlesTag) {
    lo_message with_double = lo_message_new();
    lo_message_add_double(with_double, 12.5);
    for (int i = 0; i < 3; ++i) lo_message_add_double(with_double, i);
    source.datagram(bytes_of("/left", with_double));
    ASSERT_EQ(next(), SourceStatus::sample);
    EXPECT_TRUE(sample.has_time);
    EXPECT_EQ(sample.sample.t_s, 12.5);
    EXPECT_EQ(sample.sample.position, Vector3d(0, 1, 2));

    OscSource tagged{std::to_string(app::free_udp_port()), {}};
    const lo_timetag tag{3941194747u, 1u << 31};  // an hour of 2024 and a half second
    lo_bundle bundle = lo_bundle_new(tag);
    lo_message inside = floats({1, 2, 3});
    lo_bundle_add_message(bundle, "/left", inside);
    std::size_t size = 0;
    void* bytes = lo_bundle_serialise(bundle, nullptr, &size);
    tagged.datagram({static_cast<char*>(bytes), size});
    std::free(bytes);
    lo_bundle_free_recursive(bundle);
    ASSERT_EQ(tagged.next(sample, 0), SourceStatus::sample);  // at once, though the tag may lie ahead
    EXPECT_TRUE(sample.has_time);
    EXPECT_EQ(sample.sample.t_s, 0.5);
    EXPECT_EQ(tagged.head().base_s, 3941194747.0);
}

TEST_F(OscSourceTest, SaysWhatIsWrongWithTheFirst) {
    source.datagram(bytes_of("/1/fader1", floats({0.5F})));
    source.datagram(bytes_of("/left", floats({1, 2})));
    source.datagram(bytes_of("/left", floats({1, 2, std::nanf("")})));
    source.datagram(bytes_of("/left", floats({1, 2, 3, 1, 1, 1, 1})));
    source.datagram(bytes_of("/left", floats({1, 2, 3, 4})));
    const std::string noise = "noise";
    source.datagram({noise.data(), noise.size()});
    EXPECT_EQ(next(), SourceStatus::waiting);
    EXPECT_EQ(source.faults().malformed, 6u);
    EXPECT_EQ(source.faults().first,
              "osc /1/fader1: error: found this address, expected /musicworld/stick/NAME or /NAME");
}

TEST_F(OscSourceTest, MutatedDatagramsGiveSoundSamplesOrOneLine) {
    lo_message timed = lo_message_new();
    lo_message_add_double(timed, 12.5);
    for (int i = 0; i < 3; ++i) lo_message_add_float(timed, 0.25F * static_cast<float>(i));
    for (const float q : {0.6F, 0.8F, 0.0F, 0.0F}) lo_message_add_float(timed, q);
    const std::vector<char> message = bytes_of("/musicworld/stick/left", timed);
    const std::string good(message.begin(), message.end());
    std::mt19937 random(22);
    int taken = 0;
    for (int i = 0; i < 20000 && !HasFailure(); ++i) {
        const std::string bytes = tracking::mutated(good, random);
        source.datagram({bytes.data(), bytes.size()});
        while (next() == SourceStatus::sample) {
            expect_sound(sample.sample);
            ++taken;
        }
    }
    EXPECT_GT(taken, 100);
    EXPECT_GT(source.faults().malformed, 1000u);
    EXPECT_EQ(source.faults().first.find_first_of(std::string("\n\r\0", 3)), std::string::npos);
    EXPECT_LE(source.sticks().names().size(), 16u);
}

TEST_F(OscSourceTest, BundlesOfBundlesAreTakenToADepthAndBrokenOnesAreCounted) {
    const std::vector<char> message = bytes_of("/left", floats({1, 2, 3}));
    const auto bundle = [](const std::vector<char>& inside, std::size_t said) {
        std::string text("#bundle", 8);
        text += std::string("\0\0\0\0\0\0\0\1", 8);  // at once
        for (const int shift : {24, 16, 8, 0}) text += static_cast<char>(said >> shift & 0xff);
        text.append(inside.begin(), inside.end());
        return std::vector<char>(text.begin(), text.end());
    };
    std::vector<char> nested = message;
    for (int depth = 1; depth <= 10; ++depth) {
        nested = bundle(nested, nested.size());
        source.datagram(nested);
        EXPECT_EQ(next(), depth <= 8 ? SourceStatus::sample : SourceStatus::waiting) << depth;
    }
    EXPECT_EQ(source.faults().malformed, 2u);
    for (const std::size_t said : {message.size() + 4, std::size_t(0xffffffff), std::size_t(0x80000000)})
        source.datagram(bundle(message, said));
    source.datagram(std::vector<char>(nested.begin(), nested.begin() + 12));
    EXPECT_EQ(next(), SourceStatus::waiting);
    EXPECT_EQ(source.faults().malformed, 6u);
}

/// Whether a datagram to that address of this machine reaches the source.
bool reaches(app::SampleSource& source, const char* address, int port) {
    const std::vector<char> message = bytes_of("/left", floats({1, 2, 3}));
    const int descriptor = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, address, &to.sin_addr);
    (void)sendto(descriptor, message.data(), message.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    close(descriptor);
    SourceSample sample;  // what was sent on this machine is there at once
    return source.next(sample, app::monotonic_ns() + 100'000'000) == SourceStatus::sample;
}

TEST(OscPorts, AreOfLoopbackUnlessAllOrAnAddressIsAskedFor) {
    const int port = app::free_udp_port();
    const std::string number = std::to_string(port);
    {
        OscSource loopback(number, {});
        EXPECT_TRUE(reaches(loopback, "127.0.0.1", port));
        EXPECT_FALSE(reaches(loopback, "127.0.0.2", port));  // as any other address of this machine
    }
    {
        OscSource all("*:" + number, {});
        EXPECT_TRUE(reaches(all, "127.0.0.1", port));
        EXPECT_TRUE(reaches(all, "127.0.0.2", port));
    }
    OscSource one("127.0.0.3:" + number, {});
    EXPECT_FALSE(reaches(one, "127.0.0.1", port));
    EXPECT_TRUE(reaches(one, "127.0.0.3", port));
    EXPECT_THROW(OscSource("localhost:" + number, {}), app::BadInput);         // numbers only
    EXPECT_THROW(OscSource("203.0.113.7:" + number, {}), std::runtime_error);  // of another machine
}

TEST(OscPorts, AreChecked) {
    for (const char* port : {"", "0", "65536", "9000x", "-1", ":9000", "*:", "*:0"})
        EXPECT_THROW(app::check_osc_port(port), app::BadInput) << port;
    const int port = app::free_udp_port();
    const OscSource first(std::to_string(port), {});
    EXPECT_THROW(OscSource(std::to_string(port), {}), std::runtime_error);
}

}  // namespace
