
// ---- downloads -----------------------------------------------------------------------------------------------

const downloadsView = { key: '' };

function showDownloads({ status }) {
  const key = JSON.stringify(status.devices.map((device) => device.name));
  if (downloadsView.key === key) return;
  downloadsView.key = key;
  const view = byId('view-downloads');
  head(view, 'Downloads', element('ul', 'choice'));
  const files = section(view, 'downloads-files', 'Files', true).appendChild(element('ul', 'files'));
  const file = (href, name, text) => {
    const item = files.appendChild(element('li'));
    const link = item.appendChild(element('a', '', name));
    link.href = href;
    link.download = name;
    item.append(` – ${text}`);
  };
  for (const { name } of status.devices) {
    file(`/api/v1/eds?device=${name}`, `${name}.eds`, `electronic data sheet of the device ${name}, for the controller’s tool`);
  }
  file('/api/v1/configuration', 'axisbridge.toml', 'the configuration that runs, without comments and secrets');
  file('/bundle', 'axisbridge-bundle.tar', 'the diagnostics bundle: everything on this list, the recording and the contacts');
  file('/recording.pcapng', 'recording.pcapng', 'frames of all sides in the last seconds, for Wireshark');
  file('/api/v1/status', 'status.json', 'the state of everything now');
  file('/api/v1/faults', 'faults.json', 'faults that are present, and faults that were');
  file('/api/v1/log?lines=1000', 'log.json', 'the last lines of the log');
  file('/metrics', 'metrics.txt', 'counters and values for Prometheus');
  file('/api/v1/openapi.json', 'openapi.json', 'description of the paths for programs');
}
