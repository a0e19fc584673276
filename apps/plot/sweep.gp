# SPDX-License-Identifier: Apache-2.0
# Draws sweeps of a run of striper guide, beam by beam, with the threshold on them: is it above the road, below the paint?
#
#   gnuplot -c apps/plot/sweep.gp SWEEPS.csv PLOT.svg [FIRST [BEAMS [THRESHOLD...]]]
#
# PLOT ends in .svg or .png; FIRST is the first sweep of the file to draw (1), BEAMS how many follow one another (3);
# a threshold for each of them, or one for all.
if (ARGC < 2) {
  print "usage: gnuplot -c sweep.gp SWEEPS.csv PLOT.svg|PLOT.png [FIRST [BEAMS [THRESHOLD...]]]"
  exit status 2
}
first = ARGC >= 3 ? ARG3 + 0 : 1
beams = ARGC >= 4 ? ARG4 + 0 : 3
array given[5] = [ARG5, ARG6, ARG7, ARG8, ARG9]
threshold(beam) = given[beam] ne "" ? given[beam] + 0 : (given[1] ne "" ? given[1] + 0 : NaN)
# A line of the table is a curve: its cells behind time, counts and name, one below the other.
line(beam) = sprintf("sed -n '%dp' '%s'", first + beam, ARG1)
samples(beam) = "< " . line(beam) . " | tr ',' '\\n' | tail -n +4"
name(beam) = system(line(beam) . " | cut -d, -f3")
if (name(1) eq "") {
  print ARG1, ": there is no sweep ", first
  exit status 1
}

if (strlen(ARG2) > 4 && substr(ARG2, strlen(ARG2) - 3, strlen(ARG2)) eq ".png") {
  set terminal pngcairo size 1000, 240 * beams noenhanced font "Sans,11" background "white"
} else {
  set terminal svg size 1000, 240 * beams noenhanced font "Sans,13" background "white"
}
set output ARG2
set multiplot layout beams, 1 title sprintf("What the beams see across the road, from its left to its right: sweeps %d to %d of %s\n ", \
  first, first + beams - 1, ARG1)
set border linecolor rgb "#888888"
set tics textcolor rgb "#444444"
set grid back linetype 1 linecolor rgb "#e4e4e4"
set ylabel "detector (counts)"
set key outside top right horizontal
set xrange [0:*]
set autoscale xfixmax
do for [beam = 1:beams] {
  if (beam == beams) { set xlabel "sample of the sweep" }
  stats samples(beam) using 1 name "BEAM" nooutput
  top = threshold(beam) > BEAM_max ? threshold(beam) : BEAM_max
  set yrange [0 : 1.1 * top]
  plot samples(beam) using 0:1 with steps linewidth 1.5 linecolor rgb "#12395c" title "beam " . name(beam), \
       threshold(beam) with lines dashtype 2 linewidth 1.5 linecolor rgb "#b22222" \
         title given[1] ne "" ? sprintf("threshold %g", threshold(beam)) : ""
}
unset multiplot
