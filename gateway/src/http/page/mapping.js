
// ---- the values of an axis with their places on both sides ---------------------------------------------------

const MAPPED = ['Generic name', 'Value', 'CIP', 'Drive', 'Gateway'];
const MAPPED_UNITS = {
  position_command: '', position: '', following_error: '', velocity_command: '/s', velocity: '/s',
};
// The commands are those of the gateway.
const MAPPED_COMMANDS = ['position_command', 'velocity_command', 'torque_command'];
const MAPPED_FIXED = { torque_command: '%', torque: '%', current: 'A', bus_voltage: 'V', temperature: '°C' };

const mappingView = { name: null };

function buildMapping(name) {
  const view = byId('view-mapping');
  const subtitle = head(view, `Mapping of ${name}`, axisChoice('mapping', name));
  const part = section(view, 'mapping-values', 'Values', true);
  const label = part.appendChild(element('label', '', 'Show only rows with '));
  const filter = label.appendChild(element('input'));
  filter.type = 'search';
  filter.placeholder = 'name, attribute, IDN, object';
  filter.addEventListener('input', filterMapping);
  Object.assign(mappingView, { name, subtitle, filter, table: table(part, MAPPED), asked: false, live: [] });
}

function fillMapping(sheet) {
  rows(mappingView.table, sheet.values, labels(MAPPED, 9), (value) => [
    { text: value.name, more: value.kind },
    { text: '' },
    { text: value.cip.join(', ') },
    { text: value.drive.join(', ') },
    { text: value.gateway },
  ]);
  mappingView.live = sheet.values
    .map((value, index) => ({ field: value.field, cell: mappingView.table.children[index].children[1].firstElementChild }))
    .filter(({ field }) => field !== null);
  filterMapping();
}

function filterMapping() {
  const wanted = mappingView.filter.value.toLowerCase();
  for (const row of mappingView.table.children) row.hidden = !row.textContent.toLowerCase().includes(wanted);
}

function showMapping({ status }, name) {
  const axis = status.axes.find((known) => known.name === name);
  if (!axis) return unknown(`There is no axis ${name}.`);
  if (mappingView.name !== name) buildMapping(name);
  askSheet(mappingView, (sheet) => {
    fillMapping(sheet);
    if (last) showMapping(last, name);
  });
  setText(mappingView.subtitle, [axis.device, axis.bus, axis.drive, axis.address].filter(Boolean).join(', '));
  for (const { field, cell } of mappingView.live) {
    const value = axis[field];
    const old = isOld(axis) && value !== null && !MAPPED_COMMANDS.includes(field);
    const unit = MAPPED_FIXED[field] || `${axis.unit}${MAPPED_UNITS[field] || ''}`;
    setText(cell, value === null ? 'not in the telegram' : number(value, unit.startsWith(axis.unit) ? 6 : 2, unit));
    setClass(cell, old ? 'old' : 'value');
    setText(cell.nextElementSibling, old ? 'last reported' : '');
    cell.nextElementSibling.hidden = !old;
  }
  return undefined;
}
