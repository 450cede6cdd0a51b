// What lies beside a recording: marks and flags, and predictions made elsewhere; the first byte says which.
#include "compare/recording.h"

#include "files/bad_input.h"
#include "fuzz_target.h"
#include "sticks/prediction_file.h"
#include "written_input.h"

namespace {

constexpr std::string_view kTrace =
    "t,stick,px,py,pz\n0,a,0,1,0\n0,b,0,1,0\n0.1,a,0,0.9,0\n0.1,b,0,1,0\n0.2,a,0,1,0\n0.2,b,0,1,0\n";

void match(const std::filesystem::path& file) {
    const app::PredictionFile predictions = app::read_prediction_file(file);
    const tracking::Trace trace = tracking::parse_trace(kTrace, "trace");
    for (const tracking::StickTrace& stick : trace.sticks) {
        const auto replay = app::make_replay(app::match_predictions(predictions, stick.name, stick.samples));
        for (const tracking::PoseSample& sample : stick.samples) (void)replay->correct(sample);
        require(replay->predict(0.05).position.allFinite(), "a prediction that is none");
    }
}

}  // namespace

void fuzz_recording(std::string_view bytes) {
    static const WrittenInput predictions("fuzz.csv"), trace("take.csv");
    if (bytes.empty()) return;
    const std::string_view rest = bytes.substr(1);
    try {
        if (bytes[0] == 'p') return match(predictions.with(rest));
        trace.beside(bytes[0] == 'f' ? "take.flags.csv" : "take.hits.csv", rest);
        (void)app::read_recording(trace.with(kTrace).string());
    } catch (const app::BadInput& fault) {
        require_located(fault, "");
    } catch (const tracking::TraceError& fault) {
        require_located(fault, "");
    }
}
