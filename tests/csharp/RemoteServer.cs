// The server of tests that cannot start one, because they run for another system: it is in serve_tests (tests/client), which has
// started them.

using System;
using System.IO;
using System.Net;

sealed class Server : IDisposable
{
    readonly string port, id;

    /// The port of serve_tests on this machine.
    public Server(string port)
    {
        this.port = port;
        var said = Ask("/open").Split(' ');
        id = said[0];
        Address = said[1];
    }

    public string Address { get; }

    public void Start() { Ask("/start?id=" + id); }

    public void Kill() { Ask("/stop?id=" + id); }

    public void Dispose() { Ask("/close?id=" + id); }

    string Ask(string path)
    {
        using (var answer = WebRequest.Create("http://127.0.0.1:" + port + path).GetResponse())
        using (var body = new StreamReader(answer.GetResponseStream())) return body.ReadToEnd();
    }
}
