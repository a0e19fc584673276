# SPDX-License-Identifier: Apache-2.0
# Draws one scan from above, each return with its pixel-quantised error bar (range_near_m to
# range_far_m) along its bearing, as in Figure 4 of Mertz et al. 2002.
#
#   gnuplot -c apps/plot/scan.gp SCANS.csv PLOT.svg [FRAME]
#
# PLOT ends in .svg or .png; FRAME is the first of the file unless given.
if (ARGC < 2) {
  print "usage: gnuplot -c scan.gp SCANS.csv PLOT.svg|PLOT.png [FRAME]"
  exit status 2
}
scans = ARG1
set datafile separator comma
set datafile columnheaders
set datafile missing ""

stats scans using (column("frame")) name "FRAMES" nooutput
frame = ARGC >= 3 ? ARG3 + 0 : FRAMES_min
of_frame(value) = column("frame") == frame ? value : NaN
stats scans using (of_frame(column("range_m"))) name "RANGE" nooutput
if (!exists("RANGE_max")) {
  print scans, ": frame ", frame, " has no ranges (was there a model?)"
  exit status 1
}

# The plot reaches as far as the returns do, but for the few that lie three quartile distances beyond the upper
# quartile: a single false return at the horizon would shrink all others to a spot.
min(a, b) = a < b ? a : b
reach = min(RANGE_max, RANGE_up_quartile + 3 * (RANGE_up_quartile - RANGE_lo_quartile) + 0.1 * RANGE_up_quartile)
within_reach(value) = column("range_m") <= reach ? of_frame(value) : NaN
stats scans using (within_reach(column("range_m"))) name "DRAWN" nooutput

# Where the outer ray misses the laser plane there is no far end: the bar leaves the plot.
beyond = 2.0 * reach
far(value) = value < beyond ? value : beyond
near_x(dummy) = of_frame(column("range_near_m") * cos(column("bearing_rad")))
near_y(dummy) = of_frame(column("range_near_m") * sin(column("bearing_rad")))
bar_x(dummy) = (far(column("range_far_m")) - column("range_near_m")) * cos(column("bearing_rad"))
bar_y(dummy) = (far(column("range_far_m")) - column("range_near_m")) * sin(column("bearing_rad"))

stats scans using (within_reach(column("y_m"))) name "Y" nooutput
stats scans using (within_reach(column("x_m"))) name "X" nooutput
margin = 0.1 * reach
low_y = Y_min - margin
high_y = Y_max + margin
high_x = X_max + margin

width = 1200
height = int(width * (high_x + margin) / (high_y - low_y)) + 60
height = height < 400 ? 400 : (height > 1200 ? 1200 : height)
if (strlen(ARG2) > 4 && substr(ARG2, strlen(ARG2) - 3, strlen(ARG2)) eq ".png") {
  set terminal pngcairo size width, height font "Sans,11" background "white"
} else {
  set terminal svg size width, height font "Sans,13" background "white"
}
set output ARG2

beyond_text = RANGE_records > DRAWN_records ? sprintf(" (%d beyond the plot)", RANGE_records - DRAWN_records) : ""
set title sprintf("Frame %d: %d returns, seen from above%s", frame, RANGE_records, beyond_text)
set xlabel "y, to the left (m)"
set ylabel "x, forward (m)"
set size ratio -1
set xrange [high_y:low_y]
set yrange [-margin:high_x]
set border linecolor rgb "#888888"
set tics 0.5 textcolor rgb "#444444"
set grid back linetype 1 linecolor rgb "#e4e4e4"
set key bottom right Left reverse samplen 2
set style line 1 linecolor rgb "#f0a030" linewidth 2.5
set style line 2 linecolor rgb "#12395c" pointtype 7 pointsize 0.22
set style line 3 linecolor rgb "#b22222" pointtype 9 pointsize 1.8

plot scans using (near_y(0)):(near_x(0)):(bar_y(0)):(bar_x(0)) with vectors nohead linestyle 1 \
       title "its error bar: half a pixel nearer and farther", \
     scans using (of_frame(column("y_m"))):(of_frame(column("x_m"))) with points linestyle 2 \
       title "return", \
     "+" using (0):(0) every ::0::0 with points linestyle 3 title "striper"
