// The real server, as a process that a test starts, kills and starts again.

using System;
using System.Diagnostics;
using System.IO;

sealed class Server : IDisposable
{
    readonly string program, folder = Path.Combine(Path.GetTempPath(), "lpdeform-" + Guid.NewGuid().ToString("N").Substring(0, 8));
    Process process;

    public Server(string program)
    {
        this.program = program;
        Directory.CreateDirectory(folder);
        Start();
    }

    public string Address { get { return "unix:" + folder + "/socket"; } }

    public void Start()
    {
        process = Process.Start(new ProcessStartInfo(program, "--address " + Address + " --log-level off")
        {
            UseShellExecute = false, RedirectStandardOutput = true, RedirectStandardError = true
        });
        process.ErrorDataReceived += (sender, line) => { };
        process.BeginErrorReadLine();
        if (process.StandardOutput.ReadLine() == null) throw new Exception("the server did not start");
    }

    public void Kill()
    {
        process.Kill();
        process.WaitForExit();
    }

    public void Dispose()
    {
        Kill();
        Directory.Delete(folder, true);
    }
}
