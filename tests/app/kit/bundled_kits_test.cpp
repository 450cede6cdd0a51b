#include <gtest/gtest.h>
#include <sim/simulation.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "files/assets.h"
#include "kit/kit.h"
#include "shared_folder.h"
#include "strikes/true_contacts.h"

namespace app {
namespace {

constexpr const char* kBundled[] = {"drums",   "bells",   "strings", "rock",
                                    "timpani", "marimba", "harp",    "pads"};

/// Extent of a body along world y at its middle.
Eigen::Vector3d top_of(const Instrument& instrument) {
    return instrument.body.world_from_body * Eigen::Vector3d(0, instrument.body.shape.semi_axes.y(), 0);
}

TEST(BundledKits, DrumsHaveFiveDrumsAndThreeCymbalsWithinAPlayersReach) {
    const Kit kit = read_kit(find_kit("drums"));
    std::map<std::string, int> kinds;
    for (const Instrument& instrument : kit.instruments) {
        ++kinds[instrument.kind];
        const Eigen::Vector3d top = top_of(instrument);
        EXPECT_LT(std::hypot(top.x(), top.z()), 1.1) << instrument.name;  // an arm and a stick
        if (instrument.kind == "drum") {
            EXPECT_GT(top.y(), 0.69) << instrument.name;
            EXPECT_LT(top.y(), 0.86) << instrument.name;
        }
    }
    EXPECT_EQ(kinds["drum"], 5);
    EXPECT_EQ(kinds["cymbal"], 3);
}

TEST(BundledKits, HeadsTiltTowardsThePlayer) {
    for (const Instrument& instrument : read_kit(find_kit("drums")).instruments) {
        const Eigen::Vector3d up = instrument.body.world_from_body.linear().col(1);
        EXPECT_GT(up.z(), 0.04) << instrument.name;
        EXPECT_GT(up.y(), 0.9) << instrument.name;
    }
}

TEST(BundledKits, NoTwoBodiesTouch) {
    for (const char* name : kBundled) {
        const Kit kit = read_kit(find_kit(name));
        for (const Instrument& a : kit.instruments)
            for (const Instrument& b : kit.instruments) {
                const Eigen::Vector3d apart =
                    a.body.world_from_body.translation() - b.body.world_from_body.translation();
                if (&a == &b || apart.norm() > a.body.shape.semi_axes.norm() + b.body.shape.semi_axes.norm())
                    continue;
                for (double x = -1; x <= 1; x += 0.2)
                    for (double y = -1; y <= 1; y += 0.25)
                        for (double z = -1; z <= 1; z += 0.2) {
                            const Eigen::Vector3d point =
                                a.body.world_from_body *
                                Eigen::Vector3d(x, y, z).cwiseProduct(a.body.shape.semi_axes);
                            if (sim::rest_distance(a.body, point, 0).distance > 0) continue;
                            ASSERT_GT(sim::rest_distance(b.body, point, 0).distance, 0)
                                << name << ": " << a.name << ", " << b.name;
                        }
            }
    }
}

TEST(BundledKits, ADrumsHeadAndRimSoundShellAndUndersideAreSilent) {
    for (const Instrument& instrument : read_kit(find_kit("drums")).instruments) {
        if (instrument.kind != "drum") continue;
        const auto zone_at = [&](double x, double y) {
            const Eigen::Vector3d half = instrument.body.shape.semi_axes;
            const int zone =
                sim::rest_zone(instrument.body, instrument.body.world_from_body *
                                                    Eigen::Vector3d(x * half.x(), y * half.y(), 0));
            return zone < 0 ? "silent" : instrument.zones[static_cast<std::size_t>(zone)].name;
        };
        EXPECT_EQ(zone_at(0, 1), "head") << instrument.name;
        EXPECT_EQ(zone_at(0.8, 1), "head") << instrument.name;
        EXPECT_EQ(zone_at(0.95, 0.98), "rim") << instrument.name;
        EXPECT_EQ(zone_at(1, 0), "silent") << instrument.name;
        EXPECT_EQ(zone_at(1, 0.7), "silent") << instrument.name;
        EXPECT_EQ(zone_at(0.3, -1), "silent") << instrument.name;
    }
}

TEST(BundledKits, AllOfABellAStringAndACymbalSounds) {
    for (const char* name : kBundled)
        for (const Instrument& instrument : read_kit(find_kit(name)).instruments) {
            if (instrument.kind == "drum") continue;
            for (const Eigen::Vector3d& side :
                 {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 0, 0),
                  Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
                const Eigen::Vector3d point =
                    instrument.body.world_from_body * side.cwiseProduct(instrument.body.shape.semi_axes);
                EXPECT_GE(sim::rest_zone(instrument.body, point), 0) << name << ": " << instrument.name;
            }
        }
}

TEST(BundledKits, BellsSwingOnHingesAndRiseByTheMajorScale) {
    const Kit kit = read_kit(find_kit("bells"));
    ASSERT_EQ(kit.instruments.size(), 8u);
    constexpr int kScale[] = {0, 2, 4, 5, 7, 9, 11, 12};
    for (std::size_t i = 0; i < 8; ++i) {
        EXPECT_TRUE(kit.instruments[i].body.stand.hinged);
        EXPECT_EQ(kit.instruments[i].zones[0].midi_note, 72 + kScale[i]);
        double frequency = 0;
        for (const auto& [name, value] : kit.instruments[i].voice.parameters)
            if (name == "frequency_hz") frequency = value;
        EXPECT_NEAR(frequency, 440 * std::exp2((72 + kScale[i] - 69) / 12.0),
                    0.001);  // written with three decimals
    }
}

TEST(BundledKits, StringsAreFiveToEightMillimetresThickAndMoreThanThirtyApart) {
    const Kit kit = read_kit(find_kit("strings"));
    ASSERT_EQ(kit.instruments.size(), 8u);
    for (std::size_t i = 0; i < 8; ++i) {
        const sim::BodyDefinition& body = kit.instruments[i].body;
        EXPECT_GE(2 * body.shape.semi_axes.y(), 0.005);
        EXPECT_LE(2 * body.shape.semi_axes.y(), 0.008);
        for (std::size_t k = 0; k < i; ++k) {
            const Eigen::Vector3d apart =
                body.world_from_body.translation() - kit.instruments[k].body.world_from_body.translation();
            EXPECT_GT(apart.norm(), 0.040);
        }
    }
}

TEST(BundledKits, TheirSoundsUseParametersOfTheOrchestraWithinItsRanges) {
    std::map<std::pair<std::string, std::string>, std::pair<double, double>> known;
    std::ifstream orchestra(assets_folder() / "orchestra" / "musicworld.orc");
    for (std::string line; std::getline(orchestra, line);) {
        if (!line.starts_with(";@")) continue;
        std::istringstream words(line.substr(2));
        std::string instrument, parameter;
        double fallback = 0, low = 0, high = 0;
        words >> instrument >> parameter >> fallback >> low >> high;
        known[{instrument, parameter}] = {low, high};
    }
    ASSERT_GT(known.size(), 20u);
    for (const char* name : kBundled)
        for (const Instrument& instrument : read_kit(find_kit(name)).instruments)
            for (const auto& [parameter, value] : instrument.voice.parameters) {
                const auto range = known.find({instrument.voice.instrument, parameter});
                ASSERT_NE(range, known.end()) << instrument.voice.instrument << " " << parameter;
                EXPECT_GE(value, range->second.first) << instrument.name << " " << parameter;
                EXPECT_LE(value, range->second.second) << instrument.name << " " << parameter;
            }
}

TEST(BundledKits, TheTimpaniStandWhereTheRecordedMalletsStrike) {
    const auto shared = shared_folder();
    if (!shared) GTEST_SKIP() << "needs the recordings";
    const Kit kit = read_kit(find_kit("timpani"));
    std::size_t takes = 0, hits = 0, contacts = 0;
    for (const auto& file : std::filesystem::directory_iterator(*shared / "traces/timpani")) {
        std::string hits_file = file.path().string();
        if (!hits_file.ends_with(".hits.csv")) continue;
        std::ifstream rows(hits_file);
        hits -= 1;  // its header
        for (std::string row; std::getline(rows, row);) ++hits;
        const tracking::Trace take = tracking::read_trace(hits_file.replace(hits_file.size() - 9, 9, ".csv"));
        const StickGeometry stick = stick_geometry(take, kit.stick, {}, {});
        for (const TrueContact& contact :
             find_true_contacts(tip_tracks(take, stick), bodies_of(kit), stick.radius_m)) {
            ++contacts;
            EXPECT_EQ(kit.instruments[contact.instrument].name, "C3") << file.path();
        }
        ++takes;
    }
    EXPECT_EQ(takes, 24U);
    // Strokes end at heights that differ by 30 mm from take to take, as the tracked point does on the mallet.
    EXPECT_NEAR(static_cast<double>(contacts), static_cast<double>(hits), 0.02 * static_cast<double>(hits));
}

}  // namespace
}  // namespace app
