
// ---- system time and the cycle -------------------------------------------------------------------------------

const TEN_MINUTES = 600;

const timeView = { built: false };

function buildTime() {
  const view = byId('view-time');
  head(view, 'Time', element('ul', 'choice'));
  const time = section(view, 'time-state', 'System time').appendChild(element('dl'));
  const cycles = section(view, 'time-cycles', 'Cycles').appendChild(element('dl'));
  const chart = (title, names) => {
    const made = figure(title, names);
    section(view, `time-${title.split(' ')[0].toLowerCase()}`, title, true).appendChild(made.node);
    made.node.firstElementChild.firstElementChild.hidden = true;
    return made;
  };
  const offset = chart('Offset from the master', ['offset']);
  const phase = chart('Phase error of the buses', last.status.buses.slice(0, 4).map((bus) => bus.name));
  const late = chart('Lateness of the cycle', []);
  Object.assign(timeView, {
    built: true,
    time,
    cycles,
    offset,
    phase,
    late,
    table: table(late.node.parentElement, ['Late by at most', 'Calls', 'Share'], 1),
    samples: new Samples('/api/v1/time?', TEN_MINUTES),
  });
}

function showTimeView({ status }) {
  if (!timeView.built) buildTime();
  showTime(status.time, timeView.time);
  showCycles(status.cycles, timeView.cycles);
  showLateness(status.cycles.lateness);
  timeView.samples.update().then((fresh) => {
    if (fresh) drawTime();
  });
}

function drawTime() {
  const { lists } = timeView.samples;
  const draw = (chart, series, none) => {
    const present = series.some((values) => values.some((value) => value !== null));
    chart.svg.classList.toggle('gone', !present);
    series.forEach((values, index) => {
      const value = values.length ? values[values.length - 1] : null;
      const name = chart === timeView.offset ? 'offset' : lists.buses[index].bus;
      setText(chart.keys[index], `${name} ${value === null ? none : span(value)}`);
    });
    const micros = series.map((values) => values.map((value) => (value === null ? null : value / 1000)));
    drawLines(chart, { times: lists.uptime_s, series: micros, span: TEN_MINUTES, period: 1, least: 1, unit: 'µs' });
  };
  draw(timeView.offset, [lists.offset_ns], 'none: there is no master');
  draw(timeView.phase, lists.buses.slice(0, 4).map((bus) => bus.phase_error_ns), 'follows no system time');
}

function showLateness({ bounds_ns: bounds, counts }) {
  const all = counts.reduce((sum, count) => sum + count, 0);
  const names = [...bounds.map(span), 'more'];
  drawBars(timeView.late, names, counts);
  const items = counts.map((count, index) => ({ name: names[index], count }));
  rows(timeView.table, items, labels(['Late by at most', 'Calls', 'Share'], 1), ({ name, count }) => [
    { text: name },
    { text: whole(count) },
    { text: all ? `${(count / all * 100).toPrecision(3)} %` : '' },
  ]);
  timeView.late.svg.setAttribute('aria-label', `Lateness of the cycle: ${whole(all)} calls, in the table below`);
}
