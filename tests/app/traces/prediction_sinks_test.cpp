// What leaves for other programs.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <zmq.hpp>

#include "files/bad_input.h"
#include "temporary_folder.h"
#include "traces/live_predict.h"

namespace {

TEST(PredictionSinks, OverZeroMQASampleIsAMessageOfRows) {
    const TemporaryFolder folder;
    const std::string endpoint = "ipc://" + (folder.path() / "socket").string();
    const std::unique_ptr<app::PredictionSink> sink = app::open_prediction_sink("zmq:" + endpoint);
    app::Prediction prediction{"left", 12.5, true, {}, app::NamedStrike{0.0625, 0.75, "hi-hat"}};
    app::PredictedPose pose;
    pose.lead_s = 0.125;
    pose.pose.position = {1, 2, 3};
    pose.pose.orientation = {0, 1, 0, 0};
    prediction.poses.push_back(pose);
    pose.lead_s = 0.25;
    pose.covariance.emplace();
    pose.covariance->position << 1, 2, 3, 2, 5, 6, 3, 6, 9;
    pose.covariance->radius_50 = 1.5, pose.covariance->radius_95 = 11;
    prediction.poses.push_back(pose);

    zmq::context_t context;
    zmq::socket_t reader(context, zmq::socket_type::sub);
    reader.set(zmq::sockopt::linger, 0);
    reader.set(zmq::sockopt::rcvtimeo, 20);
    reader.set(zmq::sockopt::subscribe, "");
    reader.connect(endpoint);
    zmq::message_t message;
    for (int i = 0; i < 500 && message.size() == 0; ++i) {  // until the subscription has come
        sink->send(prediction);
        (void)reader.recv(message);
    }
    EXPECT_EQ(message.to_string(),
              "predicted,12.5,left,0.125,1,2,3,0,1,0,0\n"
              "predicted,12.5,left,0.25,1,2,3,0,1,0,0,1,2,3,5,6,9,1.5,11\n"
              "next_strike,12.5,left,0.0625,0.75,hi-hat\n");
    EXPECT_THROW((void)app::open_prediction_sink("zmq:" + endpoint + "/no/such/folder"), std::runtime_error);
}

app::Prediction small_prediction(std::size_t poses) {
    app::Prediction prediction{"left", 12.5, true, {}, {}};
    prediction.poses.resize(poses);
    return prediction;
}

/// A datagram holds 64 KiB.
TEST(PredictionSinks, OverOscAHostIsFoundOnceAndWhatCannotBeSentIsCounted) {
    const int reader = socket(AF_INET6, SOCK_DGRAM, 0);
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6, address.sin6_addr = in6addr_loopback;
    socklen_t size = sizeof address;
    if (bind(reader, reinterpret_cast<sockaddr*>(&address), size) != 0) GTEST_SKIP() << "needs IPv6";
    (void)getsockname(reader, reinterpret_cast<sockaddr*>(&address), &size);
    const auto sink = app::open_prediction_sink("osc:[::1]:" + std::to_string(ntohs(address.sin6_port)));
    sink->send(small_prediction(2));
    char bundle[1024] = {};
    EXPECT_GT(recv(reader, bundle, sizeof bundle, MSG_DONTWAIT), 100);
    EXPECT_STREQ(bundle, "#bundle");
    EXPECT_EQ(sink->unsent(), 0u);
    sink->send(small_prediction(2000));
    EXPECT_EQ(sink->unsent(), 1u);
    close(reader);
    EXPECT_THROW((void)app::open_prediction_sink("osc:no..host:9000"), app::BadInput);
}

TEST(PredictionSinks, WhatIsNoDestinationIsRefused) {
    for (const char* wrong : {"", "osc", "osc:", "osc:0", "osc:65536", "osc::9000",
                              "osc:host:", "zmq:", "zmq:nowhere", "pigeon", "udp:9000"})
        EXPECT_THROW((void)app::open_prediction_sink(wrong), app::BadInput) << wrong;
    EXPECT_NE(app::open_prediction_sink("osc:9000"), nullptr);
    EXPECT_NE(app::open_prediction_sink("osc:127.0.0.1:9000"), nullptr);
}

}  // namespace
