// SPDX-License-Identifier: Apache-2.0
// Debug: pieces of one simulated frame with truth.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "stripe/profile_extractor.hpp"

using namespace striper;
int main(int argc, char** argv) {
  Simulator sim(load_scene(argv[1]));
  const int picture = argc > 2 ? std::atoi(argv[2]) : 0;
  ScannerOptions o = ScannerOptions::for_model(sim.model());
  if (argc > 3) o.stripe.stripe_sigma_px = std::atof(argv[3]);
  o.ambient.cadence = Cadence({Illumination::laser(0)});
  AmbientStage stage(o.ambient);
  stage.push(sim.render(static_cast<std::uint64_t>(picture)));
  stage.finish();
  const LitFrame* lit = stage.next();
  detail::ProfileExtractor ex(o.stripe);
  Stripe stripe;
  ex.extract(*lit, stripe);
  const Truth truth = sim.truth(static_cast<std::uint64_t>(picture)).front();
  const auto& ch = ex.choice();
  const auto& pc = ch.pieces();
  std::printf("width %.3f lines %d pieces %zu cands %zu\n", ch.width().at_pivot, pc.lines(),
              pc.pieces().size(), pc.size());
  std::map<int, int> right;
  for (std::size_t i = 0; i < pc.size(); ++i) {
    const auto& c = pc.candidate(i);
    const auto& t = truth.lines[c.line].brightest;
    if (truth.lines[c.line].status == TruthStatus::kVisible &&
        std::abs(t.v_px - c.across) < std::max(.5, 3.0 * c.sigma))
      ++right[pc.link(i).piece];
  }
  for (std::size_t p = 0; p < pc.pieces().size(); ++p) {
    const auto& piece = pc.pieces()[p];
    if (piece.count < 4 && !right.count(p)) continue;
    const auto e = ch.evidence(piece.last);
    std::printf("%4zu lines %d-%d n %d right %d lo %.2f |", p, piece.first_line, piece.last_line,
                piece.count, right[p], ch.log_odds(piece.last));
    for (float x : e.of) std::printf(" %.2f", x);
    std::printf("\n");
  }
  int vis = 0, ok = 0, okr = 0, cand = 0;
  for (int l = 0; l < pc.lines(); ++l) {
    if (truth.lines[l].status != TruthStatus::kVisible) continue;
    const auto& t = truth.lines[l].brightest;
    ++vis;
    bool has = false;
    for (std::size_t i = pc.first_of(l); i < pc.first_of(l + 1); ++i)
      if (std::abs(pc.candidate(i).across - t.v_px) < std::max(.5, 3.0 * pc.candidate(i).sigma))
        has = true;
    cand += has;
    bool o_ = stripe.status[l] == ReturnStatus::kOk;
    ok += o_;
    okr += o_ && std::abs(stripe.across_px[l] - t.v_px) < std::max(.5, 3.0 * stripe.sigma_px[l]);
    if (!has || !o_) {
      std::printf("  line %d truth %.2f A %.1f edge %d has %d status %s conf %.3f at %.2f:", l,
                  t.v_px, t.amplitude_dn, t.near_edge, has,
                  std::string(to_string(stripe.status[l])).c_str(), stripe.confidence[l],
                  stripe.across_px[l]);
      for (std::size_t i = pc.first_of(l); i < pc.first_of(l + 1); ++i)
        std::printf(" [%.2f s%.2f A%.1f w%.2f lo%.1f p%d]", pc.candidate(i).across,
                    pc.candidate(i).sigma, pc.candidate(i).amplitude, pc.candidate(i).width,
                    ch.log_odds(i), pc.link(i).piece);
      std::printf("\n");
    }
  }
  std::printf("visible %d with candidate %d ok %d right %d\n", vis, cand, ok, okr);
}
