# SPDX-License-Identifier: Apache-2.0
# Draws a job of striper guide run over its way: where the line is at the gun with twice its sigma as a band,
# and under it what the beams saw of the line, and what the guns painted.
#
#   gnuplot -c apps/plot/guide.gp JOB PLOT.svg [TRUTH.csv [FROM_M TO_M]]
#
# JOB is the directory that guide run has written; PLOT ends in .svg or .png; TRUTH is truth.csv of a simulated run.
if (ARGC < 2) {
  print "usage: gnuplot -c guide.gp JOB PLOT.svg|PLOT.png [TRUTH.csv [FROM_M TO_M]]"
  exit status 2
}
lateral = ARG1 . "/lateral.csv"
guns = ARG1 . "/guns.csv"
seen = ARG1 . "/seen.csv"
has_truth = ARGC >= 3 && strlen(ARG3) > 0
set datafile separator comma
set datafile columnheaders
set datafile missing ""

stats lateral using (column("distance_m")) name "WAY" nooutput
from = ARGC >= 5 ? ARG4 + 0 : WAY_min
to = ARGC >= 5 ? ARG5 + 0 : WAY_max
within(d) = d >= from && d <= to
known(value) = within(column("distance_m")) && strcol("state") ne "lost" && strcol("state") ne "fault" ? value : NaN
stats lateral using (known(100 * column("lateral_m"))) name "LATERAL" nooutput
if (!exists("LATERAL_max")) {
  print lateral, ": the line is known nowhere between ", from, " and ", to, " m"
  exit status 1
}
stats lateral using (strlen(strcol("sigma_m"))) name "SIGMA" nooutput
has_sigma = SIGMA_max > 0
truth = has_truth ? ARG3 : lateral

if (strlen(ARG2) > 4 && substr(ARG2, strlen(ARG2) - 3, strlen(ARG2)) eq ".png") {
  set terminal pngcairo size 1200, 720 noenhanced font "Sans,11" background "white"
} else {
  set terminal svg size 1200, 720 noenhanced font "Sans,13" background "white"
}
set output ARG2
set multiplot
set border linecolor rgb "#888888"
set tics textcolor rgb "#444444"
set grid back linetype 1 linecolor rgb "#e4e4e4"
set xrange [from:to]
set lmargin at screen 0.10
set rmargin at screen 0.98
set label 1 sprintf("Job %s: where the line is at the gun, and what was painted", ARG1) at screen 0.10, 0.975 left

# The band is drawn where the line is known; in a gap it widens. Most of it is to be seen.
margin = 0.15 * (LATERAL_max - LATERAL_min) + 0.5
if (has_sigma) {
  stats lateral using (known(200 * column("sigma_m"))) name "BAND" nooutput
  margin = BAND_up_quartile > margin ? 1.1 * BAND_up_quartile : margin
}
set tmargin at screen 0.91
set bmargin at screen 0.41
set key at graph 1, 1.09 top right horizontal Left reverse samplen 2 width -1
set ylabel "lateral position, to the left (cm)"
set yrange [LATERAL_min - margin : LATERAL_max + margin]
set format x ""
set style fill solid 0.35 noborder
low(dummy) = known(100 * (column("lateral_m") - 2 * column("sigma_m")))
high(dummy) = known(100 * (column("lateral_m") + 2 * column("sigma_m")))
plot for [i = 1:has_sigma] lateral using (column("distance_m")):(low(0)):(high(0)) with filledcurves \
       linecolor rgb "#f0a030" title "found +- two sigma", \
     for [i = 1:has_truth] truth using (column("distance_m")):(100 * column("lateral_m")) with lines dashtype 2 linewidth 2 \
       linecolor rgb "#2a8a3e" title "true", \
     lateral using (column("distance_m")):(known(100 * column("lateral_m"))) with lines linewidth 1.5 linecolor rgb "#12395c" \
       title "found"

set tmargin at screen 0.39
set bmargin at screen 0.10
unset label 1
unset ylabel
set key at graph 0.995, 0.97 top right horizontal Left reverse samplen 1 width -1
set format x "%g"
set xlabel "along the way of the gun (m)"
set yrange [0.3:4]
set ytics ("painted" 1, "dashes seen" 2, "line seen" 3)
# What is none of a kind lies outside of the plot.
none = from - 1e6
end_of(word) = strcol("kind") eq word && within(column("distance_m")) ? column("distance_m") : none
is_on(value) = strcol("state") eq "ON" ? value : none
plot guns using (is_on(column("from_m"))):(1):(column("to_m") - column("from_m")):(0) with vectors nohead linewidth 9 \
       linecolor rgb "#b22222" notitle, \
     seen using (end_of("start")):(2) with points pointtype 9 pointsize 1.2 linecolor rgb "#2a8a3e" title "begins", \
     seen using (end_of("end")):(2) with points pointtype 11 pointsize 1.2 linecolor rgb "#12395c" title "ends", \
     seen using (end_of("line")):(3) with points pointtype 5 pointsize 0.35 linecolor rgb "#888888" notitle
unset multiplot
